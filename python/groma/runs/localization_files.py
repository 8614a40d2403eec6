"""The files that ``groma localize`` leaves beside what every run leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.io.atomic import write_text
from groma.io.landmarks import write_landmarks
from groma.io.trajectory import write_tum
from groma.localization.result import Localized
from groma.nouns.arrays import Array


def save_localized(result: Localized, directory: Path) -> None:
    """Write the files of a localized drive; those of poses and landmarks only where a pose was known.

    Parameters
    ----------
    result
        The drive; scans at which the pose was not known are left out of the trajectory.
    directory
        Exists.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    known = result.status != "lost"
    write_text(directory / "quality.csv", _quality(result))
    if not known.any():
        return
    write_tum(directory / "trajectory.tum", result.stamps[known], result.poses[known])
    write_text(directory / "covariance.txt", covariance_text(result.stamps[known], result.covariances[known]))
    write_text(directory / "stops.csv", _stops(result))
    if result.seen is not None:
        write_landmarks(directory / "landmarks.json", result.seen)


def covariance_text(stamps: Array, covariances: Array) -> str:
    """Return ``stamp xx xy xt yy yt tt`` a line (K), metres and radians, of covariances (K, 3, 3)."""
    rows, columns = np.triu_indices(3)
    lines = ["# stamp xx xy xt yy yt tt of the body-frame perturbation (x, y, theta)\n"]
    for stamp, values in zip(stamps.tolist(), covariances[:, rows, columns].tolist(), strict=True):
        lines.append(f"{stamp:.9f} " + " ".join(f"{value:.9e}" for value in values) + "\n")
    return "".join(lines)


def _quality(result: Localized) -> str:
    head = "stamp,status,observed,matched,nis,dof,sigma_position_m,sigma_heading_rad,geometry_m\n"
    columns = (
        result.stamps,
        result.status,
        result.observed,
        result.matched,
        result.nis,
        result.dof,
        result.sigma_position,
        result.sigma_heading,
        result.geometry,
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return head + "".join(
        f"{t:.9f},{status},{observed},{matched},{nis:.6g},{dof},{sp:.6g},{sh:.6g},{geometry:.6g}\n"
        for t, status, observed, matched, nis, dof, sp, sh, geometry in rows
    )


def _stops(result: Localized) -> str:
    head = "from,to,x,y,theta,sigma_m,scatter_m,landmarks\n"
    return head + "".join(
        f"{h.from_stamp:.9f},{h.to_stamp:.9f},{h.pose[0]:.6f},{h.pose[1]:.6f},{h.pose[2]:.6f},"
        f"{h.sigma_m:.6g},{h.scatter_m:.6g},{h.matched:.3g}\n"
        for h in result.halts
    )
