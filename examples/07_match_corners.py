"""Match the corners of two scans: FALKO keypoints, association, and the rigid motion between the two places.

Prints the number of matched corners and the error of the motion.
"""

import numpy as np

from groma.features.association import associate
from groma.features.corners import falko
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry
from groma.nouns.poses import Pose

GEOMETRY = BeamGeometry(-np.pi, np.deg2rad(0.5), 0.0, 0.1, 30.0)
BEARING = GEOMETRY.angle_min + GEOMETRY.angle_increment * np.arange(720)
WALLS = np.array([[0, 0], [9, 0], [9, 3], [7, 3], [7, 6], [2, 6], [2, 4], [0, 4], [0, 0]], dtype=float)


def scan(pose: Pose) -> Array:
    """Return the ranges that a scanner measures in the room, with noise of 5 mm."""
    x, y, theta = pose
    direction = np.column_stack([np.cos(BEARING + theta), np.sin(BEARING + theta)])
    begin, side = WALLS[:-1] - [x, y], np.diff(WALLS, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = direction[:, :1] * side[:, 1] - direction[:, 1:] * side[:, 0]
        distance = (begin[:, 0] * side[:, 1] - begin[:, 1] * side[:, 0]) / cross
        along = (begin[:, 0] * direction[:, 1:] - begin[:, 1] * direction[:, :1]) / cross
    hits = np.where((distance > 0) & (along >= 0) & (along <= 1), distance, np.inf)
    ranges: Array = hits.min(axis=1) + np.random.default_rng(1).normal(0, 0.005, len(BEARING))
    return ranges


first = falko(scan((3.0, 2.0, 0.0)), GEOMETRY)
second = falko(scan((4.0, 2.5, 0.6)), GEOMETRY)
best = associate(first.point, second.point)[0]
error = np.abs(best.transform - [1.0, 0.5, 0.6])
print(f"{len(best.pairs)} corners matched, error {1000 * max(error[:2]):.0f} mm and {np.rad2deg(error[2]):.2f} deg")
