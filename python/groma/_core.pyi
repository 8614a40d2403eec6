from _typeshed import SupportsGetItem, SupportsLenAndGetItem
from collections.abc import Callable
from numpy import bool_, float32, float64, int64, int8, uint8
from numpy.typing import NDArray
from typing import Final, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "CalibrateVehicle", "CalibrationArrays", "CalibrationData", "CalibrationOutcome", "CameraArrays", "CornerDetector", "ExplorerState", "GlarotIndex", "GlarotSignature", "GraphArrays", "GridArrays", "Keypoints", "KnownPosesMap", "LandmarkArrays", "Localize", "LocalizedDrive", "Localizer", "LocalizerUpdate", "MapArrays", "MapAtPoses", "MapState", "Mapper", "NetworkArrays", "NetworkRenderer", "NetworkSurvey", "Observer", "PlacedCamera", "PoseQuality", "PromotedMap", "Recognizer", "Relocalizer", "SimulatedArrays", "SimulatedNetworkArrays", "Standstill", "Token", "VehicleEstimate", "appearance_defaults", "associate", "between", "bounds", "bsc_describe", "calibrate_camera", "calibration_scenario", "camera_calibration_defaults", "camera_lenses", "camera_mount", "camera_panel_pose", "camera_plan", "camera_plan_defaults", "camera_project", "camera_ranking", "camera_seeing", "camera_study", "camera_trials", "camera_unproject", "cgh_describe", "check_vehicle", "composed", "dead_reckoning", "detect_tags", "detection_defaults", "driving_factor", "exploration_check", "exploration_defaults", "exploration_run", "exploration_scene", "exploration_try", "feature_defaults", "find_tag_panels", "finding_catalogue", "finding_verdict", "foot_of", "interval_factor", "localization_defaults", "localize_defaults", "map_defaults", "motions_between_poses", "network_defaults", "network_scene", "network_scenes", "odometry_jumps", "pattern_corners", "place_by_poses", "planar_sigmas", "points_seen", "pose_graph_defaults", "pose_graph_marginals", "pose_graph_optimize", "pose_sigmas", "projection_sigmas", "promote", "promotion_defaults", "read_odometry_as_wheels", "read_wheels", "recognition_defaults", "refine_corners", "reflector_detect", "render_target", "rigid_fit", "simulate_calibration", "simulate_network", "simulate_scenario", "simulation_scenario", "simulation_scenes", "stamp_disorder", "steps_back", "tag_drawings", "target_check", "vehicle_calibrate", "vehicle_calibration_defaults", "vehicle_closed_form", "vehicle_grid", "vehicle_handedness", "vehicle_plan", "vehicle_plan_defaults", "wheel_motion", "wheel_noise_defaults"]

__version__: Final[str]
"""
Of groma.
"""

@final
class CalibrateVehicle:
    """
    Calibrates a vehicle from its messages; `axle` is that of wheels made from odometry [m].
    """
    def __new__(cls, /, settings: str, axle: SupportsFloat | SupportsIndex) -> CalibrateVehicle: ...
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]:
        """
        What was noticed about the messages so far.
        """
    def finish(self, /, token: Token | None = None, show: Callable[..., object] | None = None) -> CalibrationOutcome:
        """
        What all messages give.
        """
    def push_odometry(self, /, stamp: SupportsFloat | SupportsIndex, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, theta: SupportsFloat | SupportsIndex) -> None:
        """
        Odometry of the vehicle that represents its wheels.
        """
    def push_pose(self, /, stamp: SupportsFloat | SupportsIndex, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, theta: SupportsFloat | SupportsIndex) -> None:
        """
        A pose of the sensor.
        """
    def push_scan(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> None:
        """
        A scan; `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`.
        """
    def push_wheels(self, /, stamp: SupportsFloat | SupportsIndex, positions: SupportsGetItem[int, tuple[SupportsIndex, SupportsFloat | SupportsIndex]]) -> None:
        """
        Readings of joints: which of the two, and its position.
        """
    def snapshot(self, /, token: Token | None = None, show: Callable[..., object] | None = None) -> CalibrationOutcome:
        """
        What the messages so far give.
        """
    def state(self, /) -> tuple[int, int, int, bool]:
        """
        Readings of the wheels, observations of the sensor, scans kept, whether the wheels stand.
        """

@final
class CalibrationArrays:
    """
    A simulated recording for calibration and its truth, as arrays.
    """
    @property
    def ranges(self, /) -> NDArray[float64]: ...
    @property
    def readings(self, /) -> NDArray[float64]: ...
    @property
    def scan_poses(self, /) -> NDArray[float64]: ...
    @property
    def scan_stamps(self, /) -> NDArray[float64]: ...
    @property
    def truth(self, /) -> NDArray[float64]: ...
    @property
    def wheel_stamps(self, /) -> NDArray[float64]: ...

@final
class CalibrationData:
    """
    What a calibration was made of: wheel readings, how the drive was cut, motions of the laser.
    """
    @property
    def breaks(self, /) -> NDArray[float64]: ...
    @property
    def coupling(self, /) -> NDArray[float64] | None: ...
    @property
    def covariance(self, /) -> NDArray[float64] | None: ...
    @property
    def end(self, /) -> NDArray[float64]: ...
    @property
    def kind(self, /) -> str: ...
    @property
    def left_out(self, /) -> list[tuple[str, float, float]]:
        """
        Why, first and last stamp [s].
        """
    @property
    def motion(self, /) -> NDArray[float64]: ...
    @property
    def readings(self, /) -> NDArray[float64]: ...
    @property
    def start(self, /) -> NDArray[float64]: ...
    @property
    def stations(self, /) -> NDArray[float64]: ...
    @property
    def time(self, /) -> NDArray[float64]: ...

@final
class CalibrationOutcome:
    """
    A calibration with what it was made of.
    """
    def data(self, /) -> CalibrationData:
        """
        What it was made of, as arrays by name.
        """
    def driven(self, /) -> NDArray[float64]:
        """
        Distance [m] and turn [rad] (m, 2) of every motion, by the wheels.
        """
    def estimate(self, /) -> VehicleEstimate:
        """
        The estimate, as `vehicle_calibrate` gives it.
        """
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]:
        """
        All that was noticed.
        """
    def laser_paths(self, /) -> list[tuple[NDArray[float64], NDArray[float64]]]:
        """
        The path of the laser in pieces (k, 2): as measured, and as the wheels tell it.
        """
    def missed(self, /, tolerances: dict[str, SupportsFloat | SupportsIndex]) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]:
        """
        Parameters that are not yet known as well as wanted, by name and tolerance [SI].
        """

@final
class CameraArrays:
    """
    A calibration, flat: of views, one row each (V); of corners, one each in the order given (N).
    """
    @property
    def covariance(self, /) -> NDArray[float64]: ...
    @property
    def covariances(self, /) -> NDArray[float64]: ...
    @property
    def decided(self, /) -> list[bool]: ...
    @property
    def dof(self, /) -> int: ...
    @property
    def held_out_rms(self, /) -> float | None: ...
    @property
    def honesty(self, /) -> float | None: ...
    @property
    def inflated(self, /) -> NDArray[float64]: ...
    @property
    def known(self, /) -> list[bool]: ...
    @property
    def parameters(self, /) -> list[float]: ...
    @property
    def poses(self, /) -> NDArray[float64]: ...
    @property
    def projection_rms(self, /) -> float: ...
    @property
    def residual_factor(self, /) -> float: ...
    @property
    def residuals(self, /) -> NDArray[float64]: ...
    @property
    def rms(self, /) -> float: ...
    @property
    def rms_all(self, /) -> float: ...
    @property
    def sigmas(self, /) -> list[float]: ...
    @property
    def sigmas_claimed(self, /) -> list[float]: ...
    @property
    def splits(self, /) -> int: ...
    @property
    def taken(self, /) -> list[bool]: ...
    @property
    def tilt_spread(self, /) -> float: ...
    @property
    def used(self, /) -> list[bool]: ...
    @property
    def view_places(self, /) -> list[list[float] | None]: ...
    @property
    def view_rms(self, /) -> list[float | None]: ...
    @property
    def weak(self, /) -> tuple[list[int], float]: ...
    @property
    def white(self, /) -> NDArray[float64]: ...
    @property
    def z_rms(self, /) -> list[float]: ...

@final
class CornerDetector:
    """
    Finds the corners of the scans of one scanner; keeps its tables from one scan to the next.
    """
    def __new__(cls, /, name: str, beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], options: str) -> CornerDetector:
        """
        `name` is `falko` or `oc`, `beams` `(angle_min, angle_increment, range_min, range_max)`, `options` JSON.
        """
    def detect(self, /, ranges: NDArray[float64]) -> Keypoints:
        """
        The corners of a scan.
        """
    def detect_all(self, /, scans: SupportsGetItem[int, NDArray[float64]]) -> list[Keypoints]:
        """
        The corners of many scans, over all processors, with the GIL released.
        """

@final
class ExplorerState:
    """
    A robot that explores.
    """
    def __new__(cls, /, settings: str, announced: SupportsIndex, start: str, heading: SupportsFloat | SupportsIndex) -> ExplorerState: ...
    def driven(self, /) -> float: ...
    def has_found_all(self, /) -> bool: ...
    def next_exit(self, /) -> int | None: ...
    def observe(self, /, event: str) -> None: ...
    def sigma(self, /) -> float: ...

@final
class GlarotIndex:
    """
    Signatures, searched exactly.
    """
    def __len__(self, /) -> int: ...
    def __new__(cls, /) -> GlarotIndex: ...
    def add(self, /, signature: GlarotSignature) -> int: ...
    def query(self, /, signature: GlarotSignature, k: SupportsIndex, allowed: NDArray[bool_] | None) -> list[tuple[int, float, float]]:
        """
        `(index, distance, rotation)` of the `k` nearest, of those allowed where a mask is given.
        """

@final
class GlarotSignature:
    """
    The signature of a set of landmarks.
    """
    def __new__(cls, /, points: NDArray[float64], options: str) -> GlarotSignature: ...
    def distance(self, /, other: GlarotSignature) -> tuple[float, float]:
        """
        Distance 0 to 1, and the rotation that takes the points of self onto those of other, modulo pi.
        """
    def distance_unturned(self, /, other: GlarotSignature) -> float:
        """
        Distance 0 to 1 without turning either.
        """

@final
class GraphArrays:
    """
    The optimised pose graph.
    """
    @property
    def chi_squares(self, /) -> NDArray[float64]: ...
    @property
    def covariances(self, /) -> NDArray[float64]: ...
    @property
    def information(self, /) -> NDArray[float64]: ...
    @property
    def kinds(self, /) -> list[str]: ...
    @property
    def measurements(self, /) -> NDArray[float64]: ...
    @property
    def pairs(self, /) -> NDArray[int64]: ...
    @property
    def poses(self, /) -> NDArray[float64]: ...
    @property
    def stamps(self, /) -> NDArray[float64]: ...

@final
class GridArrays:
    """
    An occupancy grid: -1 unknown, 0 free, 100 occupied.
    """
    @property
    def cells(self, /) -> NDArray[int8]: ...
    @property
    def origin(self, /) -> tuple[float, float]: ...
    @property
    def resolution(self, /) -> float: ...

@final
class Keypoints:
    """
    The K keypoints of one scan, in beam order, in the laser frame.
    """
    def __len__(self, /) -> int: ...
    @property
    def count(self, /) -> int: ...
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        (K, 2, 2) covariance of the position [m^2].
        """
    @property
    def index(self, /) -> NDArray[int64]:
        """
        (K,) beam that hit the corner.
        """
    @property
    def orientation(self, /) -> NDArray[float64]:
        """
        (K,) direction into which the corner opens, in (-pi, pi] [rad].
        """
    @property
    def point(self, /) -> NDArray[float64]:
        """
        (K, 2) position [m].
        """
    @property
    def radius(self, /) -> NDArray[float64]:
        """
        (K,) radius of the neighbourhood in which the corner was judged [m].
        """

@final
class KnownPosesMap:
    """
    A map at known poses.
    """
    @property
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]: ...
    @property
    def grid(self, /) -> GridArrays: ...
    @property
    def keyframes(self, /) -> int: ...
    @property
    def landmarks(self, /) -> LandmarkArrays: ...
    @property
    def scans(self, /) -> int: ...

@final
class LandmarkArrays:
    """
    Corners and reflectors in the frame of the map.
    """
    @property
    def covariances(self, /) -> NDArray[float64]: ...
    @property
    def descriptors(self, /) -> NDArray[uint8]: ...
    @property
    def kinds(self, /) -> list[str]: ...
    @property
    def orientations(self, /) -> NDArray[float64]: ...
    @property
    def positions(self, /) -> NDArray[float64]: ...
    @property
    def seen(self, /) -> NDArray[int64]: ...
    @property
    def visible(self, /) -> NDArray[int64]: ...

@final
class Localize:
    """
    A drive on its way through the localizer.
    """
    def __new__(cls, /, landmarks: NDArray[float64], reflector: NDArray[bool_], descriptors: NDArray[uint8], grid: tuple[SupportsFloat | SupportsIndex, tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], NDArray[int8]] | None, begin: tuple[tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], NDArray[float64] | None] | None, mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], vehicle: str | None, options: str, token: Token | None) -> Localize:
        """
        The map as for `Localizer`; `begin` with its covariance or without, `mount` is `T_base_laser`, a vehicle is JSON.
        """
    def finish(self, /) -> LocalizedDrive:
        """
        Takes what still waits; the result.
        """
    def push_odometry(self, /, stamp: SupportsFloat | SupportsIndex, pose: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> list[tuple[int, bool]]:
        """
        A reading that is not finite or out of its bound is left out and counted.
        """
    def push_scan(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], intensities: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> list[tuple[int, bool]]:
        """
        The fixes that are new or were corrected.
        """
    def push_start(self, /, stamp: SupportsFloat | SupportsIndex, pose: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], covariance: NDArray[float64]) -> list[tuple[int, bool]]: ...
    def push_wheels(self, /, stamp: SupportsFloat | SupportsIndex, positions: SupportsGetItem[int, tuple[SupportsIndex, SupportsFloat | SupportsIndex]]) -> list[tuple[int, bool]]:
        """
        Joint (0 or 1) and position of each.
        """
    def snapshot(self, /) -> LocalizedDrive:
        """
        The result so far.
        """
    def state(self, /) -> tuple[float, tuple[float, float, float], NDArray[float64], PoseQuality] | None:
        """
        Stamp, pose, covariance, quality; none before the first message.
        """

@final
class LocalizedDrive:
    """
    A localized drive.
    """
    @property
    def corrected(self, /) -> NDArray[bool_]: ...
    @property
    def counts(self, /) -> list[tuple[str, int]]: ...
    @property
    def covariances(self, /) -> NDArray[float64]: ...
    @property
    def distance(self, /) -> NDArray[float64]: ...
    @property
    def dof(self, /) -> NDArray[int64]: ...
    @property
    def extrapolated(self, /) -> NDArray[float64]: ...
    @property
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]: ...
    @property
    def geometry(self, /) -> NDArray[float64]: ...
    @property
    def halts(self, /) -> list[tuple[float, float, tuple[float, float, float], float, float, float]]:
        """
        First and last stamp, pose, sigma [m], scatter [m], landmarks matched in the mean.
        """
    @property
    def matched(self, /) -> NDArray[int64]: ...
    @property
    def nis(self, /) -> NDArray[float64]: ...
    @property
    def observed(self, /) -> NDArray[int64]: ...
    @property
    def poses(self, /) -> NDArray[float64]: ...
    @property
    def seen(self, /) -> LandmarkArrays | None: ...
    @property
    def sigma_heading(self, /) -> NDArray[float64]: ...
    @property
    def sigma_position(self, /) -> NDArray[float64]: ...
    @property
    def stamps(self, /) -> NDArray[float64]: ...
    @property
    def status(self, /) -> list[str]: ...
    @property
    def used(self, /) -> NDArray[int64]: ...
    @property
    def weak(self, /) -> list[tuple[float, float, tuple[float, float], float, str]]:
        """
        First and last stamp, place, sigma [m], why.
        """

@final
class Localizer:
    """
    A vehicle on a map.
    """
    def __new__(cls, /, landmarks: NDArray[float64], reflector: NDArray[bool_], descriptors: NDArray[uint8], stamp: SupportsFloat | SupportsIndex, pose: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex] | None, covariance: NDArray[float64], mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], calibration: NDArray[float64] | None, relocalizer: Relocalizer | None, options: str) -> Localizer:
        """
        `landmarks` are rows of x, y, the covariance (4), orientation, seen, visible.
        """
    def found(self, /) -> tuple[int, int]:
        """
        Landmarks found during the drive that constrain the pose, and those on trial.
        """
    def predict(self, /, stamp: SupportsFloat | SupportsIndex, motion: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], covariance: NDArray[float64], by_drive: NDArray[float64] | None) -> None:
        """
        A motion until `stamp` with the covariance of its right perturbation and, optional, its derivative by the drive.
        """
    def quality(self, /) -> PoseQuality: ...
    def relocate(self, /, pose: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], covariance: NDArray[float64]) -> None:
        """
        The pose has been found another way.
        """
    def state(self, /) -> tuple[float, tuple[float, float, float], NDArray[float64]]:
        """
        Stamp, pose, covariance.
        """
    def update(self, /, observations: NDArray[float64], reflector: NDArray[bool_], descriptors: NDArray[uint8], identities: NDArray[int64], scan: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], NDArray[float64]] | None) -> LocalizerUpdate:
        """
        The corners and reflectors of a scan: stamp, range, bearing, covariance (4), orientation a row.
        """

@final
class LocalizerUpdate:
    """
    What a scan changed: M pairings of observations with landmarks.
    """
    @property
    def begun(self, /) -> int:
        """
        Landmarks begun.
        """
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        (M, 2, 2) covariance of the innovation.
        """
    @property
    def cut_short(self, /) -> bool:
        """
        Whether the joint search met its cap and nearest neighbours were taken.
        """
    @property
    def forgotten(self, /) -> int:
        """
        Landmarks forgotten.
        """
    @property
    def holds(self, /) -> NDArray[bool_]:
        """
        (M,) whether the landmark constrains the pose; one on trial does not.
        """
    @property
    def innovation(self, /) -> NDArray[float64]:
        """
        (M, 2) range [m] and bearing [rad], measured less predicted.
        """
    @property
    def landmark(self, /) -> NDArray[int64]:
        """
        (M,) index of the landmark in the map, or a number beyond for one found during the drive.
        """
    @property
    def observation(self, /) -> NDArray[int64]:
        """
        (M,) index of the observation.
        """
    @property
    def proven(self, /) -> int:
        """
        Landmarks that constrain the pose from now on.
        """
    @property
    def quality(self, /) -> PoseQuality: ...
    @property
    def relocated(self, /) -> float | None:
        """
        The probability with which the place was found anew, where it was.
        """
    @property
    def unusable(self, /) -> int:
        """
        Observations not finite, without range or covariance, or out of range.
        """

@final
class MapArrays:
    """
    A map.
    """
    @property
    def closures(self, /) -> NDArray[float64]:
        """
        From, to (keyframes), overlap, correction [m], residual [m], residual [rad] a row.
        """
    @property
    def counts(self, /) -> dict[str, float]: ...
    @property
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]: ...
    @property
    def graph(self, /) -> GraphArrays: ...
    @property
    def grid(self, /) -> GridArrays: ...
    @property
    def landmarks(self, /) -> LandmarkArrays: ...
    @property
    def odometry(self, /) -> NDArray[float64]: ...
    @property
    def tracked(self, /) -> NDArray[float64]: ...
    @property
    def trajectory(self, /) -> NDArray[float64]: ...
    @property
    def trajectory_stamps(self, /) -> NDArray[float64]: ...
    @property
    def verdict(self, /) -> str: ...
    @property
    def verdicts(self, /) -> list[str]:
        """
        Why each closure was rejected; empty when it was accepted.
        """
    @property
    def weak(self, /) -> list[tuple[float, float, float, float, float, float, str]]:
        """
        First and last stamp, x, y, sigma [m], direction [rad], why.
        """

@final
class MapAtPoses:
    """
    Builds a map from scans at known poses; `finish` may be called once.
    """
    def __new__(cls, /, options: str, mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], lateness: SupportsFloat | SupportsIndex = 0.0) -> MapAtPoses:
        """
        `mount` is `T_base_laser`; messages up to `lateness` seconds late are put into order.
        """
    def finish(self, /, token: Token | None = None) -> KnownPosesMap:
        """
        The map.
        """
    def push_pose(self, /, stamp: SupportsFloat | SupportsIndex, pose: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], covariance: NDArray[float64]) -> None:
        """
        `T_map_base` at a time, with the covariance (3, 3) of its perturbation on the right.
        """
    def push_scan(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], intensities: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> None: ...
    def state(self, /) -> tuple[int, int, int]:
        """
        Scans that came, that were used and that wait for a pose.
        """

@final
class MapState:
    """
    How far a map is.
    """
    @property
    def closures(self, /) -> int: ...
    @property
    def covariance(self, /) -> NDArray[float64]: ...
    @property
    def keyframes(self, /) -> int: ...
    @property
    def local_maps(self, /) -> int: ...
    @property
    def pose(self, /) -> tuple[float, float, float]: ...
    @property
    def stamp(self, /) -> float: ...

@final
class Mapper:
    """
    Builds a map from messages in the order in which they come.
    """
    def __new__(cls, /, options: str, mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], vehicle: str | None = None, axle: SupportsFloat | SupportsIndex = 1.0) -> Mapper:
        """
        `mount` is `T_base_laser`, where there is no `vehicle` (JSON); `axle` is that of wheels made from odometry [m].
        """
    def finish(self, /, token: Token | None = None, show: Callable[..., object] | None = None) -> MapArrays:
        """
        The map of everything; may be called once.
        """
    def push_odometry(self, /, stamp: SupportsFloat | SupportsIndex, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, theta: SupportsFloat | SupportsIndex) -> None:
        """
        Odometry; of a vehicle, that which represents its wheels.
        """
    def push_scan(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], intensities: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> None:
        """
        `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`; intensities as many as ranges, or
        none.
        """
    def push_wheels(self, /, stamp: SupportsFloat | SupportsIndex, positions: SupportsGetItem[int, tuple[SupportsIndex, SupportsFloat | SupportsIndex]]) -> None:
        """
        Readings of joints of the vehicle: which of the two, and its position.
        """
    def snapshot(self, /, token: Token | None = None, show: Callable[..., object] | None = None) -> MapArrays:
        """
        The map of what has had its turn; goes on as if nobody had asked.
        """
    def state(self, /) -> MapState | None:
        """
        None before the first scan.
        """

@final
class NetworkArrays:
    """
    The map of a camera network.
    """
    @property
    def camera_chi(self, /) -> NDArray[float64]: ...
    @property
    def camera_heads(self, /) -> NDArray[int64]:
        """
        Number of the camera, first stop, whether it is still there, views a row.
        """
    @property
    def cameras(self, /) -> NDArray[float64]: ...
    @property
    def corner_chi_square(self, /) -> float | None: ...
    @property
    def covariances(self, /) -> NDArray[float64]: ...
    @property
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]: ...
    @property
    def halt_stamps(self, /) -> NDArray[float64]: ...
    @property
    def height_sigma(self, /) -> float: ...
    @property
    def intrinsics(self, /) -> list[str]:
        """
        Cameras as JSON, and the covariances of their parameters.
        """
    @property
    def intrinsics_covariances(self, /) -> list[NDArray[float64]]: ...
    @property
    def joint(self, /) -> NDArray[float64] | None: ...
    @property
    def mount(self, /) -> NDArray[float64]: ...
    @property
    def mount_covariance(self, /) -> NDArray[float64]: ...
    @property
    def moved(self, /) -> NDArray[int64]:
        """
        Camera, old and new place a row.
        """
    @property
    def nis(self, /) -> NDArray[float64]: ...
    @property
    def odometry(self, /) -> NDArray[float64]: ...
    @property
    def odometry_error(self, /) -> float | None: ...
    @property
    def path_length(self, /) -> float: ...
    @property
    def residuals(self, /) -> list[tuple[str, tuple[float, int]]]: ...
    @property
    def slip(self, /) -> int: ...
    @property
    def steps(self, /) -> tuple[int, bool]:
        """
        Steps, and whether the batch converged.
        """
    @property
    def stop_covariances(self, /) -> NDArray[float64]: ...
    @property
    def stop_halts(self, /) -> NDArray[int64]: ...
    @property
    def stops(self, /) -> NDArray[float64]: ...
    @property
    def used(self, /) -> NDArray[int64]:
        """
        Views that were used, and their chi-squares with the number of coordinates.
        """
    @property
    def verdicts(self, /) -> list[str]: ...
    @property
    def view_chi(self, /) -> NDArray[float64]: ...
    @property
    def views(self, /) -> NDArray[int64]:
        """
        Stop, camera, place (-1 for none) of every view.
        """

@final
class NetworkRenderer:
    """
    What the cameras of a simulated network see at the stops of the robot.
    """
    def __new__(cls, /, scene: str, appearance: str) -> NetworkRenderer: ...
    def image(self, /, stop: SupportsIndex, camera: SupportsIndex) -> NDArray[uint8] | None:
        """
        The image of a camera at a stop, row by row; nothing when no panel would be in view.
        """
    def stops(self, /) -> list[tuple[float, float]]:
        """
        Begin and end of each stop [s].
        """

@final
class NetworkSurvey:
    """
    A survey that messages are pushed into; `finish` may be called at any time.
    """
    def __new__(cls, /, target: str, cameras: SupportsGetItem[int, tuple[str, str, NDArray[float64] | None]]) -> NetworkSurvey:
        """
        `cameras` as JSON with the covariance of each (or None).
        """
    def finish(self, /, options: str, token: Token | None = None, show: Callable[..., object] | None = None) -> NetworkArrays:
        """
        The map.
        """
    def push_detection(self, /, stamp: SupportsFloat | SupportsIndex, camera: SupportsIndex, panel: SupportsIndex, stop: SupportsIndex | None, ids: NDArray[int64], pixels: NDArray[float64], sigmas: NDArray[float64]) -> bool:
        """
        False when it makes no sense.
        """
    def push_odometry(self, /, stamp: SupportsFloat | SupportsIndex, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, theta: SupportsFloat | SupportsIndex) -> bool:
        """
        False when it is not finite.
        """
    def state(self, /) -> tuple[int | None, int, list[tuple[int, int]]]:
        """
        Number of the stop that lasts (None while it moves), stops so far, images and stops of each camera.
        """

@final
class Observer:
    """
    Corners and reflectors of the scans of a scanner.
    """
    def __new__(cls, /) -> Observer: ...
    def observe(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], intensities: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> tuple[NDArray[float64], NDArray[bool_], NDArray[uint8]]:
        """
        Corners in beam order, then reflectors.
        """

@final
class PlacedCamera:
    """
    A fixed camera and the target on the robot, from known poses of the robot.
    """
    @property
    def camera(self, /) -> NDArray[float64]: ...
    @property
    def covariance(self, /) -> NDArray[float64]: ...
    @property
    def intrinsics(self, /) -> str: ...
    @property
    def mount(self, /) -> NDArray[float64]: ...
    @property
    def planar(self, /) -> bool: ...
    @property
    def rms(self, /) -> float: ...
    @property
    def weak(self, /) -> list[str]: ...

@final
class PoseQuality:
    """
    How good a pose is: to slow down or stop the vehicle by.
    """
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    @property
    def dof(self, /) -> int:
        """
        Degrees of freedom of `nis`.
        """
    @property
    def geometry(self, /) -> float:
        """
        Standard deviation along the weakest direction from the last scan alone [m]; infinite below two landmarks.
        """
    @property
    def lost_evidence(self, /) -> float:
        """
        Logarithm of the likelihood ratio of being lost against being right.
        """
    @property
    def matched(self, /) -> int:
        """
        Those that were paired with a landmark that constrains the pose.
        """
    @property
    def matched_share(self, /) -> float:
        """
        Share matched in the last some hundred observations.
        """
    @property
    def nis(self, /) -> float:
        """
        Sum of squared innovations of the last scan: chi-square with `dof` degrees of freedom if all is well.
        """
    @property
    def observed(self, /) -> int:
        """
        Observations of the last scan that could be used.
        """
    @property
    def sigma_heading(self, /) -> float:
        """
        Standard deviation of the heading [rad].
        """
    @property
    def sigma_position(self, /) -> float:
        """
        Standard deviation of the position along its weakest direction [m].
        """
    @property
    def status(self, /) -> str:
        """
        `tracking`: landmarks or walls constrain the pose; `coasting`: none does at present; `lost`: the pose was never known,
        or evidence says that it is wrong.
        """

@final
class PromotedMap:
    """
    A map to which landmarks were promoted.
    """
    @property
    def confirmed(self, /) -> int: ...
    @property
    def findings(self, /) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]: ...
    @property
    def landmarks(self, /) -> LandmarkArrays: ...
    @property
    def promoted(self, /) -> int: ...

@final
class Recognizer:
    """
    Finds places again; the steps are called in the order in which they stand here.
    """
    def __new__(cls, /, options: str) -> Recognizer: ...
    def associate(self, /) -> list[list[tuple[int, tuple[float, float, float], int]]]:
        """
        For every local map, the motions `(place, T_place_map, pairs)` with most pairs.
        """
    def decide(self, /) -> list[tuple[int, int, tuple[float, float, float], str, int, float, float, float]]:
        """
        The closures considered, one a local map at most.
        """
    def describe(self, /) -> list[tuple[int, int, int]]:
        """
        Makes the local maps. Of each: its first and last keyframe, its number of corners.
        """
    def push_scan(self, /, stamp: SupportsFloat | SupportsIndex, ranges: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> bool:
        """
        Whether the scan was used. `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`,
        `mount` the pose `(x, y, yaw)` of the laser on the vehicle.
        """
    def retrieve(self, /) -> list[list[tuple[int, float]]]:
        """
        For every local map, earlier ones that look like it, with their distance.
        """
    def scans(self, /) -> list[tuple[tuple[float, float, float], int, float]]:
        """
        Of every scan used: pose as tracked, keyframe, path driven up to that.
        """
    def verify(self, /) -> None:
        """
        Shows the motions to surfaces and views.
        """

@final
class Relocalizer:
    """
    A map that places are looked for on.
    """
    def __new__(cls, /, landmarks: NDArray[float64], reflector: NDArray[bool_], descriptors: NDArray[uint8], grid: tuple[SupportsFloat | SupportsIndex, tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], NDArray[int8]] | None, options: str) -> Relocalizer:
        """
        `landmarks` as for the localizer; `grid` is resolution, origin and cells (-1 unknown, 0 free, 100 occupied).
        """
    def locate(self, /, observations: NDArray[float64], reflector: NDArray[bool_], descriptors: NDArray[uint8], scan: tuple[tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], NDArray[float64]] | None, mount: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> list[tuple[tuple[float, float, float], NDArray[float64], float, float, int]]:
        """
        Places for what one scan shows: pose, covariance (9), evidence, probability, number of pairs.
        """

@final
class SimulatedArrays:
    """
    A simulated recording and its truth, as arrays.
    """
    @property
    def circles(self, /) -> NDArray[float64]: ...
    @property
    def intensities(self, /) -> NDArray[float64]: ...
    @property
    def joint_names(self, /) -> tuple[str, str]: ...
    @property
    def joints(self, /) -> NDArray[float64]: ...
    @property
    def odometry(self, /) -> NDArray[float64]: ...
    @property
    def odometry_stamps(self, /) -> NDArray[float64]: ...
    @property
    def ranges(self, /) -> NDArray[float64]: ...
    @property
    def scan_poses(self, /) -> NDArray[float64]: ...
    @property
    def scan_stamps(self, /) -> NDArray[float64]: ...
    @property
    def segments(self, /) -> NDArray[float64]: ...
    @property
    def stalls(self, /) -> NDArray[float64]: ...
    @property
    def truth(self, /) -> NDArray[float64]: ...

@final
class SimulatedNetworkArrays:
    """
    What a recorder would have of a scene, and the truth.
    """
    @property
    def cameras(self, /) -> NDArray[float64]: ...
    @property
    def heads(self, /) -> NDArray[int64]:
        """
        Stop, camera, panel and number of corners of every detection.
        """
    @property
    def ids(self, /) -> NDArray[int64]:
        """
        Corners, one detection after the other.
        """
    @property
    def lenses(self, /) -> list[str]: ...
    @property
    def mount(self, /) -> NDArray[float64]: ...
    @property
    def odometry(self, /) -> NDArray[float64]: ...
    @property
    def pixels(self, /) -> NDArray[float64]: ...
    @property
    def stamps(self, /) -> NDArray[float64]: ...
    @property
    def stop_times(self, /) -> NDArray[float64]: ...
    @property
    def stops(self, /) -> NDArray[float64]: ...

@final
class Standstill:
    """
    Tells stops from odometry as it comes.
    """
    def __new__(cls, /) -> Standstill: ...
    def push(self, /, stamp: SupportsFloat | SupportsIndex, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, theta: SupportsFloat | SupportsIndex) -> bool:
        """
        Whether the robot stands at the time of a reading.
        """
    def restart(self, /) -> None:
        """
        Forgets all: the sender started anew, or its clock was set.
        """

@final
class Token:
    """
    Cancels long work, and reports its progress.
    """
    def __new__(cls, /) -> Token: ...
    def cancel(self, /) -> None:
        """
        Asks the work to end with what it has.
        """
    @property
    def cancelled(self, /) -> bool: ...
    @property
    def progress(self, /) -> tuple[int, int]:
        """
        Steps done and all steps of the stage; 0 of 0 where nobody counts.
        """

@final
class VehicleEstimate:
    """
    A calibrated vehicle.
    """
    @property
    def chi_square(self, /) -> float: ...
    @property
    def converged(self, /) -> bool: ...
    @property
    def correlated(self, /) -> bool: ...
    @property
    def correlation(self, /) -> NDArray[float64]: ...
    @property
    def covariance(self, /) -> NDArray[float64]: ...
    @property
    def dof(self, /) -> int: ...
    @property
    def fixed(self, /) -> dict[str, float]:
        """
        Parameters that were taken as given.
        """
    @property
    def held_out(self, /) -> tuple[int, float, float, float] | None:
        """
        Folds, medians of the position [m] and the heading [rad], root mean square of the position [m].
        """
    @property
    def interval_dof(self, /) -> int | None: ...
    @property
    def model(self, /) -> str: ...
    @property
    def names(self, /) -> list[str]: ...
    @property
    def noise_scale(self, /) -> float: ...
    @property
    def notes(self, /) -> list[str]: ...
    @property
    def observed(self, /) -> list[bool]: ...
    @property
    def residuals(self, /) -> NDArray[float64]: ...
    @property
    def sigmas(self, /) -> NDArray[float64]: ...
    @property
    def tests(self, /) -> list[tuple[str, float, int, float]]:
        """
        Name, statistic, degrees of freedom, p-value.
        """
    @property
    def values(self, /) -> NDArray[float64]: ...
    @property
    def weak(self, /) -> list[tuple[list[float], str]]:
        """
        Direction over the parameters, and in words.
        """
    @property
    def weights(self, /) -> NDArray[float64]: ...

def appearance_defaults() -> str:
    """
    The default appearance as JSON.
    """

def associate(a: NDArray[float64], b: NDArray[float64], compatible: NDArray[bool_] | None, method: str, options: str) -> tuple[list[tuple[list[float], list[tuple[int, int]], list[float], float]], bool]:
    """
    The motions between two sets of landmarks, and whether the search ran to its end; `compatible` is a mask over
    (of a, of b), `method` and `options` are JSON.
    """

def between(a: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], b: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> tuple[float, float, float]:
    """
    `T_a_b` of two poses in one frame.
    """

def bounds() -> list[tuple[str, float, float, str]]:
    """
    Name, least and largest value, and the rule in words of every bound.
    """

def bsc_describe(ranges: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], indices: NDArray[int64], poses: NDArray[float64]) -> NDArray[uint8]:
    """
    BSC descriptors of the keypoints of a scan, 16 bytes each; `poses` is x, y, orientation, radius a keypoint.
    """

def calibrate_camera(size: tuple[SupportsIndex, SupportsIndex], views: SupportsGetItem[int, tuple[SupportsIndex, SupportsIndex]], points: NDArray[float64], pixels: NDArray[float64], sigmas: NDArray[float64], options: str, token: Token | None = None) -> CameraArrays:
    """
    Intrinsics from views: `views` is image and number of corners of each; points (N, 3), pixels (N, 2), sigmas (N).
    A refusal is a RuntimeError.
    """

def calibration_scenario(drivetrain: str, seed: SupportsIndex) -> str:
    """
    The scenario for a drivetrain (JSON), as JSON.
    """

def camera_calibration_defaults() -> str:
    """
    The default settings as JSON.
    """

def camera_lenses() -> list[tuple[str, list[str]]]:
    """
    Name and parameters of every lens model.
    """

def camera_mount(height: SupportsFloat | SupportsIndex, pitch: SupportsFloat | SupportsIndex) -> list[float]:
    """
    Position, then x, y, z, w of a camera at a height, pitched down.
    """

def camera_panel_pose(camera: str, points: NDArray[float64], pixels: NDArray[float64], sigmas: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], float, int, bool, tuple[NDArray[float64], float] | None] | None:
    """
    The pose of a panel seen by a camera; None when its corners tell none.
    """

def camera_plan(stage: str, start: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], poses: SupportsGetItem[int, tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]] | None, search: str, known: str, points: NDArray[float64], pixels: NDArray[float64], sigmas: NDArray[float64], token: Token | None = None) -> str:
    """
    The next best drives, or a drive given as `poses`. `known` has the covariance of the parameters, or null, the
    number of corners of each panel seen, and from where; points (N, 3), pixels (N, 2) and sigmas (N) are theirs.
    """

def camera_plan_defaults() -> str:
    """
    Search, trials, nominal camera, target, noise of corners.
    """

def camera_project(camera: str, points: NDArray[float64]) -> NDArray[float64]:
    """
    Pixels (m, 2) of points (m, 3) in the frame of the camera; NaN where it does not see one.
    """

def camera_ranking(stage: str, distance: SupportsFloat | SupportsIndex, noise: str) -> str:
    """
    Common trajectories, best first.
    """

def camera_seeing(robot: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], carried: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], seen: NDArray[float64]) -> list[float]:
    """
    The camera that sees a panel at `seen` (4, 4), which a robot at `robot` carries at `carried`.
    """

def camera_study(sitting: str, tries: str, token: Token | None = None) -> str:
    """
    A panel held before a camera, tried out.
    """

def camera_trials(stage: str, motion: str, distance: SupportsFloat | SupportsIndex, tries: str, token: Token | None = None) -> str:
    """
    A common trajectory, tried out.
    """

def camera_unproject(camera: str, pixels: NDArray[float64]) -> NDArray[float64]:
    """
    Directions (m, 3) of length 1 that pixels (m, 2) see; NaN where the lens model does not reach.
    """

def cgh_describe(ranges: NDArray[float64], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], indices: NDArray[int64], poses: NDArray[float64]) -> NDArray[float32]:
    """
    CGH descriptors of the keypoints of a scan, 16 shares each.
    """

def check_vehicle(json: str) -> None:
    """
    Whether a vehicle as JSON can be built; the error names the field and its value.
    """

def composed(a: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], b: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> tuple[float, float, float]:
    """
    `T_a_c` of `T_a_b` and `T_b_c`.
    """

def dead_reckoning(vehicle: str, readings: NDArray[float64], broken: SupportsGetItem[int, SupportsIndex]) -> NDArray[float64]:
    """
    The poses (n, 3) that readings (n, 2) of the wheels tell: x, y [m], heading with turns counted [rad]. `broken` are the
    readings that do not hang together with the one before.
    """

def detect_tags(image: NDArray[uint8], family: str, border: SupportsIndex) -> list[tuple[int, int, float, list[float]]]:
    """
    All tags of a family in an image (height, width), by the detector alone.
    """

def detection_defaults() -> str:
    """
    The default gates as JSON.
    """

def driving_factor(half_width: SupportsFloat | SupportsIndex, tolerance: SupportsFloat | SupportsIndex) -> float:
    """
    How many times the driving so far it takes to bring a half-width to a tolerance.
    """

def exploration_check(graph: str) -> None:
    """
    Refuses a graph that cannot be driven.
    """

def exploration_defaults() -> str:
    """
    The default settings.
    """

def exploration_run(graph: str, settings: str, tell: Callable[..., object] | None, token: Token | None = None) -> str:
    """
    One whole exploration; `tell`, if given, is called at each stop with the distance and the number of cameras found.
    """

def exploration_scene(scene: str) -> str:
    """
    The graph of a scene.
    """

def exploration_try(graph: str, walk: SupportsGetItem[int, SupportsIndex], noise: str, runs: SupportsIndex, seed: SupportsIndex, tell: Callable[..., object] | None, token: Token | None = None) -> str:
    """
    Errors of the cameras in many noisy drives, of the map by least squares and of the filter's; `tell`, if given, is
    called with the drives that are done and their number.
    """

def feature_defaults() -> list[str]:
    """
    The default options of `falko`, `glarot` and `association` as JSON.
    """

def find_tag_panels(image: NDArray[uint8], target: str, options: str) -> list[tuple[int, list[int], NDArray[float64], NDArray[float64], float, list[int]]]:
    """
    The grids of tags of a target in an image (height, width).
    """

def finding_catalogue() -> list[tuple[str, str, str | None, str, str]]:
    """
    A row a code.
    """

def finding_verdict(kind: str, codes: SupportsGetItem[int, str]) -> str:
    """
    The verdict on a run of a kind by the codes of its findings.
    """

def foot_of(camera: SupportsLenAndGetItem[SupportsFloat | SupportsIndex]) -> tuple[tuple[float, float, float], list[float]] | None:
    """
    Foot of a camera in the plane, and the camera seen from there; None when it is not above the floor or looks plumb.
    """

def interval_factor(confidence: SupportsFloat | SupportsIndex, dof: SupportsIndex | None, claims: SupportsIndex) -> float:
    """
    Half-width of an interval over the standard deviation.
    """

def localization_defaults() -> tuple[str, str]:
    """
    The settings of localization and of relocalization, and their defaults, as JSON.
    """

def localize_defaults() -> str:
    """
    The settings of localizing a drive and their defaults, as JSON.
    """

def map_defaults() -> str:
    """
    The settings of mapping and their defaults, as JSON.
    """

def motions_between_poses(stamps: NDArray[float64], poses: NDArray[float64], covariances: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64]]:
    """
    Motions between poses (n, 3) whose errors are independent.
    """

def network_defaults() -> str:
    """
    The settings of a survey and their defaults, as JSON.
    """

def network_scene(name: str, seed: SupportsIndex) -> str:
    """
    A simulated network, as JSON.
    """

def network_scenes() -> list[str]:
    """
    Names of the simulated networks.
    """

def odometry_jumps(before: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], after: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]) -> bool:
    """
    Whether no robot drives from one odometry reading `(stamp, x, y, theta)` to the next.
    """

def pattern_corners(pattern: str) -> NDArray[float64]:
    """
    Corners (k, 3) of a pattern in the frame of its panel, in the order of their numbers.
    """

def place_by_poses(camera: str, covariance: NDArray[float64], target: str, robots: NDArray[float64], heads: NDArray[int64], ids: NDArray[int64], pixels: NDArray[float64], sigma: SupportsFloat | SupportsIndex, height: SupportsFloat | SupportsIndex) -> PlacedCamera:
    """
    Camera, mount and intrinsics from known poses of the robot.

    `heads` are rows of pose, panel and number of corners.
    """

def planar_sigmas(covariances: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64]]:
    """
    Standard deviations by covariances (n, 3, 3) of x, y, heading: of the position in its worst direction, and the heading.
    """

def points_seen(points: NDArray[float64], covariances: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64]]:
    """
    Range and bearing (n, 2) of points (n, 2) in the laser frame, with covariances (n, 2, 2) from those of the points.
    """

def pose_graph_defaults() -> str:
    """
    The settings of the pose graph and their defaults, as JSON.
    """

def pose_graph_marginals(nodes: NDArray[float64], pairs: NDArray[int64], measurements: NDArray[float64], information: NDArray[float64], weights: NDArray[float64]) -> NDArray[float64]: ...
def pose_graph_optimize(nodes: NDArray[float64], pairs: NDArray[int64], measurements: NDArray[float64], information: NDArray[float64], robust: NDArray[bool_], *, max_iterations: SupportsIndex | None = None, tolerance: SupportsFloat | SupportsIndex | None = None, inlier_chi_square: SupportsFloat | SupportsIndex | None = None, convexity_step: SupportsFloat | SupportsIndex | None = None) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], int, bool]: ...

def pose_sigmas(covariance: NDArray[float64]) -> tuple[float, float]:
    """
    Standard deviations of position [m] and rotation [rad] along their worst directions, by a covariance (6, 6).
    """

def projection_sigmas(camera: str, covariance: NDArray[float64]) -> tuple[tuple[int, int], NDArray[float64], NDArray[float64]]:
    """
    Shape, pixels (2 each) and standard deviations of a grid over the image, for a covariance (n, n) of the parameters.
    """

def promote(map: tuple[NDArray[float64], NDArray[bool_], NDArray[uint8]], days: SupportsGetItem[int, tuple[NDArray[float64], NDArray[bool_], NDArray[uint8]]], options: str) -> PromotedMap:
    """
    The new map.
    """

def promotion_defaults() -> str:
    """
    The settings of promotion and their defaults, as JSON.
    """

def read_odometry_as_wheels(table: NDArray[float64], axle: SupportsFloat | SupportsIndex) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]]:
    """
    `table` has stamp, x, y and heading of an odometry a row, in the order of arrival.
    """

def read_wheels(steered: bool, table: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]]:
    """
    `table` has stamp, joint (0 or 1) and position a row, in the order of arrival.
    """

def recognition_defaults() -> str:
    """
    The settings of place recognition and their defaults, as JSON.
    """

def refine_corners(image: NDArray[uint8], guesses: NDArray[float64], directions: NDArray[float64], room: NDArray[float64]) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64]]:
    """
    Corners fitted near guesses (k, 2), whose edges run along directions (k, 4), with room (k) around: pixels (2 a corner),
    sigmas and blurs; NaN where there is none.
    """

def reflector_detect(ranges: NDArray[float64], intensities: NDArray[float64], counts: SupportsGetItem[int, SupportsIndex], beams: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], options: str) -> tuple[NDArray[int64], NDArray[int64], NDArray[float64]]:
    """
    Reflectors of scans laid end to end, `counts` beams each: how many a scan, beam indices, and rows of x, y, covariance
    (4), probability of a post, width, contrast.
    """

def render_target(camera: str, target: str, poses: NDArray[float64], appearance: str, seed: SupportsIndex) -> NDArray[uint8]:
    """
    The image of the panels of a target, at poses `T_camera_panel` (panels, 4, 4): pixels row by row.
    """

def rigid_fit(a: NDArray[float64], b: NDArray[float64], least_sigma: SupportsFloat | SupportsIndex) -> tuple[list[float], list[float], float] | None:
    """
    The rigid motion between paired points: x, y, theta; covariance by rows; root mean square distance.
    """

def simulate_calibration(scenario: str, token: Token | None = None) -> CalibrationArrays: ...

def simulate_network(scene: str) -> SimulatedNetworkArrays:
    """
    Simulates a network.
    """

def simulate_scenario(scenario: str, token: Token | None = None) -> SimulatedArrays: ...
def simulation_scenario(scene: str, seed: SupportsIndex) -> str: ...
def simulation_scenes() -> list[str]: ...

def stamp_disorder(stamps: SupportsGetItem[int, SupportsFloat | SupportsIndex]) -> float:
    """
    How late the messages of a recorded stream come, at most [s].
    """

def steps_back(poses: NDArray[float64]) -> NDArray[float64]:
    """
    Of poses (n, 7), each but the first: the one before it as seen from it, (n - 1, 4, 4).
    """

def tag_drawings(pattern: str) -> list[list[bool]]:
    """
    The modules of every tag of a grid, row by row from the top, true where white.
    """

def target_check(target: str) -> None:
    """
    Refuses a target that makes no sense.
    """

def vehicle_calibrate(time: NDArray[float64], readings: NDArray[float64], steered: bool, motions: NDArray[float64], covariances: NDArray[float64] | None, couplings: NDArray[float64] | None, asked: tuple[str | None, SupportsFloat | SupportsIndex | None, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsGetItem[int, str]], options: str) -> VehicleEstimate:
    """
    `motions` is start, end, x, y, turn a row.
    """

def vehicle_calibration_defaults() -> str:
    """
    Settings as JSON.
    """

def vehicle_closed_form(time: NDArray[float64], readings: NDArray[float64], steered: bool, motions: NDArray[float64], asked: tuple[str | None, SupportsFloat | SupportsIndex | None, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsGetItem[int, str]], centres: bool, trim: tuple[SupportsIndex, SupportsFloat | SupportsIndex]) -> tuple[list[tuple[str, float]], list[int]] | None:
    """
    The closed form alone, with trimming: the nine numbers and the motions that were kept.
    """

def vehicle_grid(model: str, parameters: dict[str, SupportsFloat | SupportsIndex], free: SupportsGetItem[int, str], sigmas: dict[str, SupportsFloat | SupportsIndex], noise: str, limits: str, count: SupportsIndex, turn: SupportsFloat | SupportsIndex) -> tuple[list[tuple[float, float, float, float, float, float, float, float]], tuple[float, float] | None]:
    """
    The grid of the thesis: arcs, and how many and how much time of it the wanted deviations take, in parts of arcs.
    """

def vehicle_handedness(json: str) -> list[tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]]:
    """
    Findings about how the wheels of a vehicle as JSON are wired.
    """

def vehicle_plan(model: str, parameters: dict[str, SupportsFloat | SupportsIndex], free: SupportsGetItem[int, str], sigmas: dict[str, SupportsFloat | SupportsIndex], noise: str, limits: str, room: tuple[SupportsGetItem[int, tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]], tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]] | None, token: Token | None = None) -> tuple[list[tuple[float, float, float, float, float, float, float, float]], list[tuple[str, float]], float, float]:
    """
    The plan of least time.
    """

def vehicle_plan_defaults() -> tuple[str, str]:
    """
    Limits and noise as JSON.
    """

def wheel_motion(tricycle: bool, parameters: SupportsLenAndGetItem[SupportsFloat | SupportsIndex], step: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex], duration: SupportsFloat | SupportsIndex, noise: str) -> tuple[tuple[float, float, float], NDArray[float64], NDArray[float64]]:
    """
    Motion, covariance of its perturbation and derivative by the drive of a step of the wheels.
    """

def wheel_noise_defaults() -> str:
    """
    The noise of wheels of which nothing else is known, as JSON.
    """
