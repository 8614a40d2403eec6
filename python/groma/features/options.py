"""Names of the settings of :mod:`groma.features.corners`."""

from __future__ import annotations

from typing import Literal, TypedDict


class FalkoOptions(TypedDict, total=False):
    """Settings of the detector."""

    a: float
    """Radius of the neighbourhood at range zero [m]: ``r = a exp(b range)``."""
    b: float
    """Growth of its logarithm with range [1/m]."""
    range_min: float
    """Nearer beams are no corners [m]."""
    range_max: float
    """Farther beams are no corners [m]."""
    min_side_points: int
    """Points a corner needs on each side."""
    beta: float
    """Radius over the least base and height of the corner's triangle."""
    sectors: int
    """Sectors of the ring on which the score is counted, even."""
    definition: Literal["normalised", "published"]
    """How scored beams become corners: the score over its maximum, one threshold for all scans and one corner a
    neighbourhood, or as published, by the sum, relative to the worst of the scan, in a search along the beams."""
    threshold: float
    """Score that a corner must stay below, of the normalised definition."""
    threshold_percent: int
    """Share of the worst score of the scan by which a corner must be better, of the published definition."""
    suppression_radius: float
    """Radius within which only the best corner stays, of the published definition [m]; of the normalised one it is that
    of the neighbourhood."""
    sub_beam: bool
    """Whether the corner is placed between the beams, where its two lines meet."""
    range_noise: float
    """Least standard deviation of a range, for the covariance [m]."""


class OcOptions(TypedDict, total=False):
    """Settings of the detector of orthogonal corners."""

    a: float
    """Radius of the neighbourhood at range zero [m]: ``r = a exp(b range)``; 0.3."""
    b: float
    """Growth of its logarithm with range [1/m]; 0.07."""
    range_min: float
    """Nearer beams are no corners [m]; 0.05."""
    range_max: float
    """Farther beams are no corners [m]; 30."""
    min_side_points: int
    """Points a corner needs on each side and on each arm; 2."""
    tolerance: float
    """Half the width of an arm [m]; 0.05."""
    angle_step: float
    """Step of the directions that are tried [rad]; half a degree."""
    rho_step: float
    """Width of the bins of the distance of a line from the scanner [m]; 0.02."""
    rho_max: float
    """Points farther than this do not vote for the direction [m]; 10."""
    suppression_radius: float
    """Radius within which only the best corner stays [m]; 0.3."""
    range_noise: float
    """Least standard deviation of a range, for the covariance [m]; 0.01."""


class GlarotOptions(TypedDict, total=False):
    """Settings of the signature."""

    n_theta: int
    """Bins over the half turn of directions."""
    n_rho: int
    """Bins over the lengths."""
    rho_max: float
    """Longest pair that counts [m]."""
    sigma_theta: float
    """Standard deviation of the kernel in direction [rad]."""
    sigma_rho: float
    """Standard deviation of the kernel in length [m]."""


class AssociationOptions(TypedDict, total=False):
    """Settings of the association."""

    tolerance: float
    """Farthest that paired landmarks may lie apart, and lengths of pairs may differ [m]."""
    point_noise: float
    """Least standard deviation of a landmark's coordinate, for the covariance [m]."""
    min_length: float
    """Shortest pair from which a motion is taken [m]."""
    max_length: float
    """Longest such pair [m]."""
    min_pairs: int
    """Fewest pairs of a hypothesis."""
    max_hypotheses: int
    """Most hypotheses returned."""
    distinct_translation: float
    """Two hypotheses differ where they move the middle of b this far apart [m] ..."""
    distinct_rotation: float
    """... or turn it this differently [rad]."""
    max_motions: int
    """Most motions looked at; above it the pairs of a are thinned out evenly."""
    max_verified: int
    """Most motions for which inliers are counted; above it votes decide which."""
