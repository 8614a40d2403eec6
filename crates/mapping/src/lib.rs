//! From scans and odometry to a map: local maps, loop closure, pose graph, occupancy and landmark maps.

pub mod closer;
pub mod closure;
pub mod conclude;
mod corners;
pub mod finder;
pub mod keyframe;
pub mod known_poses;
pub mod landmarks;
pub mod local_map;
pub mod map_result;
pub mod mapper;
pub mod occupancy;
pub mod options;
pub mod pairing;
pub mod pose_graph;
pub mod promotion;
pub mod recognition;
pub mod survey;
#[cfg(test)]
mod test_keyframe;
pub mod trajectory;
pub mod uncertainty;
pub mod verify;
pub mod weak;
