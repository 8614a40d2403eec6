//! Bindings of the Rust core: arrays in, arrays out, the GIL released. No logic lives here.

mod border;
mod calibrate_pipeline;
mod calibration;
mod camera;
mod camera_calibration;
mod camera_plan;
mod exploration;
mod features;
mod findings;
mod gate;
mod localization;
mod localize;
mod map_at_poses;
mod mapping;
mod network;
mod pose_graph;
mod poses;
mod promotion;
mod recognition;
mod rendering;
mod simulation;
mod token;
mod vehicle;
mod vehicle_plan;
mod vision;
mod wheels;

#[pyo3::pymodule]
mod _core {
    #[pymodule_export]
    use super::calibrate_pipeline::{CalibrateVehicle, CalibrationData, CalibrationOutcome, driving_factor};
    #[pymodule_export]
    use super::calibration::{
        VehicleEstimate, interval_factor, vehicle_calibrate, vehicle_calibration_defaults, vehicle_closed_form,
    };
    #[pymodule_export]
    use super::camera::{camera_lenses, camera_project, camera_unproject, pattern_corners, target_check};
    #[pymodule_export]
    use super::camera_calibration::{
        CameraArrays, calibrate_camera, camera_calibration_defaults, camera_panel_pose, projection_sigmas,
    };
    #[pymodule_export]
    use super::camera_plan::{
        camera_mount, camera_plan, camera_plan_defaults, camera_ranking, camera_study, camera_trials,
    };
    #[pymodule_export]
    use super::exploration::{
        ExplorerState, exploration_check, exploration_defaults, exploration_run, exploration_scene, exploration_try,
    };
    #[pymodule_export]
    use super::features::{
        CornerDetector, GlarotIndex, GlarotSignature, Keypoints, associate, bsc_describe, cgh_describe,
        feature_defaults, fit_rigid, reflector_detect,
    };
    #[pymodule_export]
    use super::findings::{finding_catalogue, finding_verdict};
    #[pymodule_export]
    use super::gate::bounds;
    #[pymodule_export]
    use super::localization::{
        Localizer, LocalizerUpdate, PoseQuality, Relocalizer, localization_defaults, wheel_motion,
    };
    #[pymodule_export]
    use super::localize::{Localize, LocalizedDrive, Observer, localize_defaults};
    #[pymodule_export]
    use super::map_at_poses::{KnownPosesMap, MapAtPoses};
    #[pymodule_export]
    use super::mapping::{
        GraphArrays, GridArrays, LandmarkArrays, MapArrays, MapState, Mapper, map_defaults, odometry_jumps,
    };
    #[pymodule_export]
    use super::network::{
        NetworkArrays, NetworkSurvey, PlacedCamera, SimulatedNetworkArrays, Standstill, network_defaults,
        network_scene, network_scenes, place_by_poses, pose_sigmas, simulate_network,
    };
    #[pymodule_export]
    use super::pose_graph::{pose_graph_defaults, pose_graph_marginals, pose_graph_optimize};
    #[pymodule_export]
    use super::poses::{
        between, camera_seeing, composed, foot_of, motions_between_poses, planar_sigmas, points_seen, steps_back,
    };
    #[pymodule_export]
    use super::promotion::{PromotedMap, promote, promotion_defaults};
    #[pymodule_export]
    use super::recognition::{Recognizer, recognition_defaults};
    #[pymodule_export]
    use super::rendering::{NetworkRenderer, appearance_defaults, render_target};
    #[pymodule_export]
    use super::simulation::{
        CalibrationArrays, SimulatedArrays, calibration_scenario, simulate_calibration, simulate_scenario,
        simulation_scenario, simulation_scenes,
    };
    #[pymodule_export]
    use super::token::Token;
    #[pymodule_export]
    use super::vehicle::{check_vehicle, dead_reckoning, vehicle_handedness, wheel_noise_defaults};
    #[pymodule_export]
    use super::vehicle_plan::{vehicle_grid, vehicle_plan, vehicle_plan_defaults};
    #[pymodule_export]
    use super::vision::{detect_tags, detection_defaults, find_tag_panels, refine_corners, tag_drawings};
    #[pymodule_export]
    use super::wheels::{read_odometry_as_wheels, read_wheels, stamp_disorder};

    /// Of groma.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
