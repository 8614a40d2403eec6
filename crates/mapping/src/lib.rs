//! From scans and odometry to a map: local maps, loop closure, pose graph, occupancy and landmark maps.

pub mod closer;
pub mod keyframe;
pub mod local_map;
pub mod motion;
pub mod offset;
pub mod pose_graph;
pub mod tracker;
pub mod uncertainty;
pub mod verify;
