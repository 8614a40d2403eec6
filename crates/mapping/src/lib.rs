//! From scans and odometry to a map: local maps, loop closure, pose graph, occupancy and landmark maps.

pub mod keyframe;
pub mod motion;
pub mod tracker;
