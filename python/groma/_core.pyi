"""Types of the Rust core."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str
_Landmarks = tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.uint8]]

def map_defaults() -> dict[str, object]: ...
def odometry_jumps(before: tuple[float, float, float, float], after: tuple[float, float, float, float]) -> bool: ...
def pose_graph_defaults() -> dict[str, float]: ...
def pose_graph_optimize(
    nodes: NDArray[np.float64],
    pairs: NDArray[np.int64],
    measurements: NDArray[np.float64],
    information: NDArray[np.float64],
    robust: NDArray[np.bool_],
    *,
    max_iterations: int | None = None,
    tolerance: float | None = None,
    inlier_chi_square: float | None = None,
    convexity_step: float | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int, bool]: ...
def pose_graph_marginals(
    nodes: NDArray[np.float64],
    pairs: NDArray[np.int64],
    measurements: NDArray[np.float64],
    information: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> NDArray[np.float64]: ...

class SimulatedArrays:
    scan_stamps: NDArray[np.float64]
    scan_poses: NDArray[np.float64]
    ranges: NDArray[np.float64]
    intensities: NDArray[np.float64]
    odometry_stamps: NDArray[np.float64]
    odometry: NDArray[np.float64]
    joint_names: tuple[str, str]
    joints: NDArray[np.float64]
    truth: NDArray[np.float64]
    stalls: NDArray[np.float64]
    segments: NDArray[np.float64]
    circles: NDArray[np.float64]

class CalibrationArrays:
    scan_stamps: NDArray[np.float64]
    scan_poses: NDArray[np.float64]
    ranges: NDArray[np.float64]
    wheel_stamps: NDArray[np.float64]
    readings: NDArray[np.float64]
    truth: NDArray[np.float64]

def calibration_scenario(drivetrain: str, seed: int) -> str: ...
def simulate_calibration(scenario: str, token: Token | None = None) -> CalibrationArrays: ...
def simulation_scenes() -> list[str]: ...
def simulation_scenario(scene: str, seed: int) -> str: ...
def simulate_scenario(scenario: str, token: Token | None = None) -> SimulatedArrays: ...
def feature_defaults() -> tuple[str, str, str]: ...
def falko_detect(
    ranges: NDArray[np.float64],
    counts: list[int],
    beams: tuple[float, float, float, float],
    options: str,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
]: ...
def oc_detect(
    ranges: NDArray[np.float64],
    counts: list[int],
    beams: tuple[float, float, float, float],
    options: str,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
]: ...
def reflector_detect(
    ranges: NDArray[np.float64],
    intensities: NDArray[np.float64],
    counts: list[int],
    beams: tuple[float, float, float, float],
    options: str,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]: ...
def bsc_describe(
    ranges: NDArray[np.float64],
    beams: tuple[float, float, float, float],
    indices: NDArray[np.int64],
    poses: NDArray[np.float64],
) -> NDArray[np.uint8]: ...
def cgh_describe(
    ranges: NDArray[np.float64],
    beams: tuple[float, float, float, float],
    indices: NDArray[np.int64],
    poses: NDArray[np.float64],
) -> NDArray[np.float32]: ...
def associate(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    compatible: NDArray[np.bool_] | None,
    method: str,
    options: str,
) -> tuple[list[tuple[tuple[float, float, float], list[tuple[int, int]], list[float], float]], bool]: ...
def rigid_fit(
    a: NDArray[np.float64], b: NDArray[np.float64], least_sigma: float
) -> tuple[tuple[float, float, float], list[float], float] | None: ...
def vehicle_calibration_defaults() -> str: ...
def interval_factor(confidence: float, dof: int | None, claims: int) -> float: ...
def vehicle_calibrate(
    time: NDArray[np.float64],
    readings: NDArray[np.float64],
    steered: bool,
    motions: NDArray[np.float64],
    covariances: NDArray[np.float64] | None,
    couplings: NDArray[np.float64] | None,
    asked: tuple[str | None, float | None, float, float, list[str]],
    options: str,
) -> dict[str, Any]: ...
def vehicle_closed_form(
    time: NDArray[np.float64],
    readings: NDArray[np.float64],
    steered: bool,
    motions: NDArray[np.float64],
    asked: tuple[str | None, float | None, float, float, list[str]],
    centres: bool,
    trim: tuple[int, float],
) -> tuple[list[tuple[str, float]], list[int]] | None: ...
def vehicle_plan_defaults() -> tuple[str, str]: ...
def vehicle_plan(
    model: str,
    parameters: dict[str, float],
    free: list[str],
    sigmas: dict[str, float],
    noise: str,
    limits: str,
    room: tuple[list[tuple[float, float]], tuple[float, float, float]] | None,
    token: Token | None = None,
) -> tuple[list[tuple[float, ...]], list[tuple[str, float]], float, float]: ...
def vehicle_grid(
    model: str,
    parameters: dict[str, float],
    free: list[str],
    sigmas: dict[str, float],
    noise: str,
    limits: str,
    count: int,
    turn: float,
) -> tuple[list[tuple[float, ...]], tuple[float, float] | None]: ...

class GlarotSignature:
    def __new__(cls, points: NDArray[np.float64], options: str) -> GlarotSignature: ...
    def distance(self, other: GlarotSignature) -> tuple[float, float]: ...
    def distance_unturned(self, other: GlarotSignature) -> float: ...

class GlarotIndex:
    def __new__(cls) -> GlarotIndex: ...
    def __len__(self) -> int: ...
    def add(self, signature: GlarotSignature) -> int: ...
    def query(
        self, signature: GlarotSignature, k: int, allowed: NDArray[np.bool_] | None
    ) -> list[tuple[int, float, float]]: ...

def recognition_defaults() -> dict[str, Any]: ...

class Recognizer:
    """Finds places again, a call a step; `options` is JSON."""

    def __new__(cls, options: str) -> Recognizer: ...
    def push_scan(
        self,
        stamp: float,
        ranges: NDArray[np.float64],
        beams: tuple[float, float, float, float, float],
        mount: tuple[float, float, float],
    ) -> bool: ...
    def scans(self) -> list[tuple[tuple[float, float, float], int, float]]: ...
    def describe(self) -> list[tuple[int, int, int]]: ...
    def retrieve(self) -> list[list[tuple[int, float]]]: ...
    def associate(self) -> list[list[tuple[int, tuple[float, float, float], int]]]: ...
    def verify(self) -> None: ...
    def decide(self) -> list[tuple[int, int, tuple[float, float, float], str, int, float, float, float]]: ...

class CalibrateVehicle:
    """Calibrates a vehicle from its messages; `settings` is JSON, `axle` that of wheels made from odometry [m]."""

    def __init__(self, settings: str, axle: float) -> None: ...
    def push_wheels(self, stamp: float, positions: list[tuple[int, float]]) -> None: ...
    def push_odometry(self, stamp: float, x: float, y: float, theta: float) -> None: ...
    def push_pose(self, stamp: float, x: float, y: float, theta: float) -> None: ...
    def push_scan(
        self, stamp: float, ranges: NDArray[np.float64], beams: tuple[float, float, float, float, float]
    ) -> None: ...
    def state(self) -> tuple[int, int, int, bool]: ...
    def findings(self) -> list[dict[str, Any]]: ...
    def snapshot(
        self, token: Token | None = None, show: Callable[[tuple[int, int]], None] | None = None
    ) -> CalibrationOutcome: ...
    def finish(
        self, token: Token | None = None, show: Callable[[tuple[int, int]], None] | None = None
    ) -> CalibrationOutcome: ...

class CalibrationOutcome:
    """A calibration with what it was made of."""

    def estimate(self) -> dict[str, Any]: ...
    def data(self) -> dict[str, Any]: ...
    def driven(self) -> NDArray[np.float64]: ...
    def laser_paths(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]: ...
    def findings(self) -> list[dict[str, Any]]: ...
    def missed(self, tolerances: dict[str, float]) -> list[dict[str, Any]]: ...

def driving_factor(half_width: float, tolerance: float) -> float: ...
def stamp_disorder(stamps: list[float]) -> float: ...

class Mapper:
    """Builds a map of a laser at `mount`, or of a vehicle; `options` and `vehicle` are JSON."""

    def __init__(
        self, options: str, mount: tuple[float, float, float], vehicle: str | None = None, axle: float = 1.0
    ) -> None: ...
    def push_odometry(self, stamp: float, x: float, y: float, theta: float) -> None: ...
    def push_wheels(self, stamp: float, positions: list[tuple[int, float]]) -> None: ...
    def push_scan(
        self,
        stamp: float,
        ranges: NDArray[np.float64],
        intensities: NDArray[np.float64],
        beams: tuple[float, float, float, float, float],
    ) -> None: ...
    def state(self) -> dict[str, Any] | None: ...
    def snapshot(
        self, token: Token | None = None, show: Callable[[tuple[int, int]], object] | None = None
    ) -> dict[str, Any]: ...
    def finish(
        self, token: Token | None = None, show: Callable[[tuple[int, int]], object] | None = None
    ) -> dict[str, Any]: ...

def camera_lenses() -> list[tuple[str, list[str]]]: ...
def camera_project(camera: str, points: NDArray[np.float64]) -> NDArray[np.float64]: ...
def camera_unproject(camera: str, pixels: NDArray[np.float64]) -> NDArray[np.float64]: ...
def pattern_corners(pattern: str) -> NDArray[np.float64]: ...
def target_check(target: str) -> None: ...
def localization_defaults() -> tuple[str, str]: ...
def wheel_noise_defaults() -> str: ...
def check_vehicle(json: str) -> None: ...
def vehicle_handedness(json: str) -> list[dict[str, Any]]: ...
def dead_reckoning(vehicle: str, readings: NDArray[np.float64], broken: list[int]) -> NDArray[np.float64]: ...
def wheel_motion(
    tricycle: bool, parameters: list[float], step: tuple[float, float], duration: float, noise: str
) -> tuple[tuple[float, float, float], NDArray[np.float64], NDArray[np.float64]]: ...

class Relocalizer:
    """A map that places are looked for on; `options` is JSON."""

    def __init__(
        self,
        landmarks: NDArray[np.float64],
        reflector: NDArray[np.bool_],
        descriptors: NDArray[np.uint8],
        grid: tuple[float, tuple[float, float], NDArray[np.int8]] | None,
        options: str,
    ) -> None: ...
    def locate(
        self,
        observations: NDArray[np.float64],
        reflector: NDArray[np.bool_],
        descriptors: NDArray[np.uint8],
        scan: tuple[tuple[float, float, float, float], NDArray[np.float64]] | None,
        mount: tuple[float, float, float],
    ) -> list[tuple[tuple[float, float, float], NDArray[np.float64], float, float, int]]: ...

class Localizer:
    """A vehicle on a map; `options` is JSON."""

    def __init__(
        self,
        landmarks: NDArray[np.float64],
        reflector: NDArray[np.bool_],
        descriptors: NDArray[np.uint8],
        stamp: float,
        pose: tuple[float, float, float] | None,
        covariance: NDArray[np.float64],
        mount: tuple[float, float, float],
        calibration: NDArray[np.float64] | None,
        relocalizer: Relocalizer | None,
        options: str,
    ) -> None: ...
    def predict(
        self,
        stamp: float,
        motion: tuple[float, float, float],
        covariance: NDArray[np.float64],
        by_drive: NDArray[np.float64] | None,
    ) -> None: ...
    def update(
        self,
        observations: NDArray[np.float64],
        reflector: NDArray[np.bool_],
        descriptors: NDArray[np.uint8],
        identities: NDArray[np.int64],
        scan: tuple[float, float, tuple[float, float, float, float], NDArray[np.float64]] | None,
    ) -> dict[str, Any]: ...
    def relocate(self, pose: tuple[float, float, float], covariance: NDArray[np.float64]) -> None: ...
    def state(self) -> tuple[float, tuple[float, float, float], NDArray[np.float64]]: ...
    def quality(self) -> dict[str, Any]: ...
    def found(self) -> tuple[int, int]: ...

def localize_defaults() -> str: ...

class Observer:
    """Corners and reflectors of the scans of a scanner."""

    def __init__(self) -> None: ...
    def observe(
        self,
        stamp: float,
        ranges: NDArray[np.float64],
        intensities: NDArray[np.float64],
        beams: tuple[float, float, float, float, float],
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.uint8]]: ...

class Localize:
    """A drive on its way through the localizer; `options` is JSON."""

    def __init__(
        self,
        landmarks: NDArray[np.float64],
        reflector: NDArray[np.bool_],
        descriptors: NDArray[np.uint8],
        grid: tuple[float, tuple[float, float], NDArray[np.int8]] | None,
        begin: tuple[tuple[float, float, float], NDArray[np.float64] | None] | None,
        mount: tuple[float, float, float],
        vehicle: str | None,
        options: str,
        token: Token | None,
    ) -> None: ...
    def push_scan(
        self,
        stamp: float,
        ranges: NDArray[np.float64],
        intensities: NDArray[np.float64],
        beams: tuple[float, float, float, float, float],
    ) -> list[tuple[int, bool]]: ...
    def push_odometry(self, stamp: float, pose: tuple[float, float, float]) -> list[tuple[int, bool]]: ...
    def push_wheels(self, stamp: float, positions: list[tuple[int, float]]) -> list[tuple[int, bool]]: ...
    def push_start(
        self, stamp: float, pose: tuple[float, float, float], covariance: NDArray[np.float64]
    ) -> list[tuple[int, bool]]: ...
    def state(self) -> tuple[float, tuple[float, float, float], NDArray[np.float64], dict[str, Any]] | None: ...
    def snapshot(self) -> dict[str, Any]: ...
    def finish(self) -> dict[str, Any]: ...

class MapAtPoses:
    """Builds a map from scans at known poses; `options` is JSON."""

    def __init__(self, options: str, mount: tuple[float, float, float], lateness: float = 0.0) -> None: ...
    def push_pose(self, stamp: float, pose: tuple[float, float, float], covariance: NDArray[np.float64]) -> None: ...
    def push_scan(
        self,
        stamp: float,
        ranges: NDArray[np.float64],
        intensities: NDArray[np.float64],
        beams: tuple[float, float, float, float, float],
    ) -> None: ...
    def state(self) -> tuple[int, int, int]: ...
    def finish(self, token: Token | None = None) -> dict[str, Any]: ...

def network_defaults() -> dict[str, object]: ...
def network_scenes() -> list[str]: ...
def network_scene(name: str, seed: int) -> str: ...
def simulate_network(scene: str) -> dict[str, Any]: ...
def place_by_poses(
    camera: str,
    covariance: NDArray[np.float64],
    target: str,
    robots: NDArray[np.float64],
    heads: NDArray[np.int64],
    ids: NDArray[np.int64],
    pixels: NDArray[np.float64],
    sigma: float,
    height: float,
) -> dict[str, Any]: ...

class NetworkSurvey:
    def __init__(self, target: str, cameras: list[tuple[str, str, NDArray[np.float64] | None]]) -> None: ...
    def push_odometry(self, stamp: float, x: float, y: float, theta: float) -> bool: ...
    def push_detection(
        self,
        stamp: float,
        camera: int,
        panel: int,
        stop: int | None,
        ids: NDArray[np.int64],
        pixels: NDArray[np.float64],
        sigmas: NDArray[np.float64],
    ) -> bool: ...
    def state(self) -> tuple[int | None, int, list[tuple[int, int]]]: ...
    def finish(
        self, options: str, token: Token | None = None, show: Callable[[int, int], None] | None = None
    ) -> dict[str, Any]: ...

def pose_sigmas(covariance: NDArray[np.float64]) -> tuple[float, float]: ...
def foot_of(camera: list[float]) -> tuple[tuple[float, float, float], tuple[float, ...]] | None: ...
def camera_seeing(
    robot: tuple[float, float, float], carried: list[float], seen: NDArray[np.float64]
) -> tuple[float, ...]: ...
def composed(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]: ...
def between(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]: ...
def steps_back(poses: NDArray[np.float64]) -> NDArray[np.float64]: ...
def points_seen(
    points: NDArray[np.float64], covariances: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def planar_sigmas(covariances: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def motions_between_poses(
    stamps: NDArray[np.float64], poses: NDArray[np.float64], covariances: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...

class Standstill:
    def __init__(self) -> None: ...
    def push(self, stamp: float, x: float, y: float, theta: float) -> bool: ...
    def restart(self) -> None: ...

def detection_defaults() -> str: ...
def find_tag_panels(
    image: NDArray[np.uint8], target: str, options: str
) -> list[
    tuple[int, list[int], NDArray[np.float64], NDArray[np.float64], float, tuple[int, int, int, int, int, int]]
]: ...
def detect_tags(
    image: NDArray[np.uint8], family: str, border: int
) -> list[tuple[int, int, float, tuple[float, ...]]]: ...
def refine_corners(
    image: NDArray[np.uint8],
    guesses: NDArray[np.float64],
    directions: NDArray[np.float64],
    room: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def tag_drawings(pattern: str) -> list[list[bool]]: ...
def appearance_defaults() -> str: ...
def render_target(
    camera: str, target: str, poses: NDArray[np.float64], appearance: str, seed: int
) -> NDArray[np.uint8]: ...

class NetworkRenderer:
    def __init__(self, scene: str, appearance: str) -> None: ...
    def stops(self) -> list[tuple[float, float]]: ...
    def image(self, stop: int, camera: int) -> NDArray[np.uint8] | None: ...

class CameraArrays:
    parameters: list[float]
    covariance: NDArray[np.float64]
    inflated: NDArray[np.float64]
    residual_factor: float
    rms: float
    rms_all: float
    held_out_rms: float | None
    tilt_spread: float
    weak: tuple[list[int], float]
    dof: int
    honesty: float | None
    z_rms: list[float]
    projection_rms: float
    splits: int
    known: list[bool]
    taken: list[bool]
    decided: list[bool]
    poses: NDArray[np.float64]
    white: NDArray[np.float64]
    covariances: NDArray[np.float64]
    residuals: NDArray[np.float64]
    used: list[bool]
    view_rms: list[float | None]
    view_places: list[list[float] | None]
    sigmas_claimed: list[float]
    sigmas: list[float]

def camera_calibration_defaults() -> str: ...
def calibrate_camera(
    size: tuple[int, int],
    views: list[tuple[int, int]],
    points: NDArray[np.float64],
    pixels: NDArray[np.float64],
    sigmas: NDArray[np.float64],
    options: str,
    token: Token | None = None,
) -> CameraArrays: ...
def camera_panel_pose(
    camera: str, points: NDArray[np.float64], pixels: NDArray[np.float64], sigmas: NDArray[np.float64]
) -> (
    tuple[
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.float64],
        float,
        int,
        bool,
        tuple[NDArray[np.float64], float] | None,
    ]
    | None
): ...
def projection_sigmas(
    camera: str, covariance: NDArray[np.float64]
) -> tuple[tuple[int, int], NDArray[np.float64], NDArray[np.float64]]: ...
def exploration_defaults() -> str: ...
def exploration_scene(scene: str) -> str: ...
def exploration_check(graph: str) -> None: ...
def exploration_run(
    graph: str, settings: str, tell: Callable[[float, int], object] | None, token: Token | None = None
) -> str: ...
def exploration_try(
    graph: str,
    walk: list[int],
    noise: str,
    runs: int,
    seed: int,
    tell: Callable[[int, int], object] | None,
    token: Token | None = None,
) -> str: ...

class ExplorerState:
    def __new__(cls, settings: str, announced: int, start: str, heading: float) -> ExplorerState: ...
    def next_exit(self) -> int | None: ...
    def observe(self, event: str) -> None: ...
    def driven(self) -> float: ...
    def sigma(self) -> float: ...
    def has_found_all(self) -> bool: ...

def camera_plan_defaults() -> str: ...
def camera_mount(height: float, pitch: float) -> list[float]: ...
def camera_plan(
    stage: str,
    start: tuple[float, float, float],
    poses: list[tuple[float, float, float]] | None,
    search: str,
    known: str,
    points: NDArray[np.float64],
    pixels: NDArray[np.float64],
    sigmas: NDArray[np.float64],
    token: Token | None = None,
) -> str: ...
def camera_ranking(stage: str, distance: float, noise: str) -> str: ...
def camera_trials(stage: str, motion: str, distance: float, tries: str, token: Token | None = None) -> str: ...
def camera_study(sitting: str, tries: str, token: Token | None = None) -> str: ...
def bounds() -> list[tuple[str, float, float, str]]: ...

class Token:
    def __init__(self) -> None: ...
    def cancel(self) -> None: ...
    @property
    def cancelled(self) -> bool: ...
    @property
    def progress(self) -> tuple[int, int]: ...

def promotion_defaults() -> dict[str, object]: ...
def promote(static: _Landmarks, days: list[_Landmarks], options: str) -> dict[str, Any]: ...

_Rows = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], list[dict[str, Any]]]

def read_wheels(steered: bool, table: NDArray[np.float64]) -> _Rows: ...
def read_odometry_as_wheels(table: NDArray[np.float64], axle: float) -> _Rows: ...
def finding_catalogue() -> list[tuple[str, Any, str | None, str, str]]: ...
def finding_verdict(kind: str, codes: list[str]) -> str: ...
