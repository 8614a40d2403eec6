"""Names of the settings of localization.

Those of :class:`groma.localization.localizer.Localizer`, of
:func:`groma.localization.drive.localize_drive` and of the relocalizer.
"""

from __future__ import annotations

from typing import Literal, TypedDict

Mode = Literal["static", "dynamic", "mixed", "reflectors", "slam"]


class DynamicOptions(TypedDict, total=False):
    """The life of a landmark found during the drive."""

    separation: float
    """A corner this far from every landmark begins a new one [m]."""
    hits: int
    """It constrains the pose after so many sightings,"""
    trial: int
    """which must be made within so many scans that could see it."""
    refined: int
    """It is refined up to so many sightings."""
    misses: int
    """It is forgotten after so many scans in a row that could see it and did not,"""
    share_min: float
    """or when the share of scans that saw it falls below this,"""
    way_max: float
    """or when it was not seen for so long a way [m],"""
    time_max: float
    """or time [s]."""
    count_max: int
    """Landmarks found during the drive that are kept, at most."""
    anchor_sigma: float
    """In mixed mode they are begun while the standard deviation of the position is below this [m]."""


class LostOptions(TypedDict, total=False):
    """When the localizer says that it is lost."""

    evidence: float
    """Evidence for being lost against being right at which it says so: a ratio of likelihoods."""
    sigma_max: float
    """Standard deviation of the position beyond which it is lost without further evidence [m]."""


class LocalizerOptions(TypedDict, total=False):
    """Settings of the localizer."""

    mode: Mode
    """Landmarks in use: those of the map; found during the drive; both; the reflectors of the map; both, all of
    them estimated with the pose (EKF-SLAM)."""
    gate: float
    """Share of true pairs that pass the gates, individual and joint."""
    orientation_max: float
    """Corners are paired when their orientations differ by less than this [rad] ..."""
    descriptor_max: int
    """... and at most so many of the 128 cells of their descriptors."""
    max_nodes: int
    """Steps of the joint search, at most; beyond, mutual nearest neighbours that are clearly nearest."""
    range_max: float
    """Observations beyond this range are not used [m]."""
    memory: int
    """Landmarks of the map whose error is remembered from scan to scan, at most."""
    dynamic: DynamicOptions
    lost: LostOptions


class OdometryNoise(TypedDict, total=False):
    """How far odometry is to be trusted: a random walk."""

    along: float
    """Along the path after one metre [m],"""
    across: float
    """across it [m],"""
    heading: float
    """in heading [rad];"""
    turning: float
    """in heading after a turn of one radian [rad]."""


class RelocalizeOptions(TypedDict, total=False):
    """Settings of the search for the place while it is not known."""

    tolerance: float
    """Seen and mapped landmarks belong together within this distance [m]."""
    orientation_max: float
    """Corners are paired when their orientations differ by less than this [rad]."""
    length_max: float
    """Pairs of landmarks count up to this length [m]."""
    poses_max: int
    """Poses looked at, at most."""
    known_share: float
    """Share of what is seen that the map knows, on average."""
    confident: float
    """Probability from which the answer is taken for right."""


class LocalizeOptions(LocalizerOptions, total=False):
    """Settings of localizing a drive."""

    lateness: float
    """Messages wait for others that are up to this late [s]."""
    odometry: OdometryNoise
    """How far odometry is to be trusted; calibrated wheels have a noise of their own."""
    relocalize: RelocalizeOptions
