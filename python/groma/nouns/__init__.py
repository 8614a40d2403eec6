"""The values that all of groma shares: messages, vehicle, camera, target, maps, poses, findings."""
