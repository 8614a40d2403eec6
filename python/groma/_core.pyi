"""Types of the Rust core."""

import numpy as np
from numpy.typing import NDArray

__version__: str

def map_defaults() -> dict[str, object]: ...
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

def simulation_scenes() -> list[str]: ...
def simulation_scenario(scene: str, seed: int) -> str: ...
def simulate_scenario(scenario: str) -> SimulatedArrays: ...
