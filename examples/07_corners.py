"""Find the corners of two laser scans, describe them, and find the motion between the scans from them alone.

Only numpy arrays go in: ranges and beam geometry. The scans are taken in a hall of 10 x 8 m with piers, 1.5 m and
50 degrees apart. Corners are found by FALKO and described by BSC (binary shape context); no first guess is needed.

Prints how many corners are found and paired, and the motion with its standard deviations.
The last line is the error of the translation, below 30 mm.
"""

import numpy as np

from groma.features.corners import associate, bsc, bsc_distance, falko
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry
from groma.nouns.poses import relative

SOUTH = [(0, 0), (2, 0), (2, 0.6), (3, 0.6), (3, 0), (6.5, 0), (6.5, 0.6), (7.5, 0.6), (7.5, 0)]
EAST = [(10, 0), (10, 3), (9.4, 3), (9.4, 4), (10, 4)]
NORTH = [(10, 8), (8.2, 8), (8.2, 7.4), (7.2, 7.4), (7.2, 8), (4, 8), (4, 7.4), (3, 7.4), (3, 8)]
WEST = [(0, 8), (0, 5.5), (0.6, 5.5), (0.6, 4.5), (0, 4.5)]
CORNERS = np.array(SOUTH + EAST + NORTH + WEST)
BEAMS = BeamGeometry(angle_min=0.0, angle_increment=np.radians(0.25), time_increment=0.0, range_min=0.1, range_max=30.0)


def scan(pose: Array) -> Array:
    """Return the ranges that a scanner measures all round, with a noise of 5 mm."""
    bearing = pose[2] + BEAMS.angle_min + BEAMS.angle_increment * np.arange(1440)[:, None]
    x, y = (CORNERS - pose[:2]).T
    u, v = (np.roll(CORNERS, -1, axis=0) - CORNERS).T  # walls, from corner to corner
    turn = np.cos(bearing) * v - np.sin(bearing) * u  # zero where beam and wall are parallel
    along, across = (x * v - y * u) / turn, (x * np.sin(bearing) - y * np.cos(bearing)) / turn
    hit = (along > 0) & (across >= 0) & (across <= 1)
    nearest: Array = np.where(hit, along, np.inf).min(axis=1)
    return nearest + np.random.default_rng(1).normal(0.0, 0.005, 1440)


poses = np.array([[4.0, 3.5, 0.1], [5.2, 4.4, 0.97]])
first, second = scan(poses[0]), scan(poses[1])
a, b = falko(first, BEAMS), falko(second, BEAMS)
similar = bsc_distance(bsc(first, BEAMS, a), bsc(second, BEAMS, b)) <= 24  # of 128 cells differ
best = associate(a.point, b.point, similar)[0]

x, y, theta = best.transform
sigma = np.sqrt(np.diag(best.covariance))
error = best.transform - relative(poses[0], poses[1])
print(f"corners: {len(a)} and {len(b)}, {len(best.pairs)} pairs")
print(f"motion: x {x:.3f} ± {sigma[0]:.3f} m, y {y:.3f} ± {sigma[1]:.3f} m, theta {theta:.3f} ± {sigma[2]:.3f} rad")
print(f"error of the rotation: {abs(np.degrees(error[2])):.2f} deg")
print(f"error of the translation: {1000 * np.hypot(error[0], error[1]):.0f} mm")
