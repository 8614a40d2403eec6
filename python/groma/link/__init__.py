"""Live transport between camera nodes and the robot's survey, over Zenoh; see docs/reference/camera_protocol.md."""
