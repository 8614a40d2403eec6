"""Pictures of a camera network."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.nouns.arrays import Array
from groma.nouns.network import MappedCamera, NetworkMap
from groma.nouns.poses import rotation_matrix
from groma.report.drawing import ACCEPTED, FINAL, INK, LINE, MUTED, ODOMETRY, REJECTED, WEAK, WIDTH, axes, drawn, sheet
from groma.report.network.figures import current

AZIMUTH, ELEVATION = math.radians(-60), math.radians(35)
"""From where the picture in space is seen."""
SIGMAS = 3.0
"""Of ellipsoids."""
FRUSTUM = 0.9
"""Length of a camera's pyramid [m]."""


@drawn("The cameras in space with their uncertainty, and the drive")
def in_space(network: NetworkMap) -> Figure:
    """Draw cameras, their ellipsoids and the stops in an orthographic view."""
    figure = sheet(4.6)
    ax = axes(figure, 0.1, 0.1, WIDTH - 0.2, 4.4)
    ax.set_aspect("equal")
    ax.axis("off")
    _floor(ax, network)
    path = _seen(network.stops[:, :3])
    ax.plot(*path.T, color=FINAL, linewidth=1.0)
    ax.plot(*path.T, ".", color=FINAL, markersize=3)
    for camera in network.cameras:
        _camera(ax, camera)
    return figure


@drawn("The map from above, odometry alone beside it")
def from_above(network: NetworkMap) -> Figure:
    """Draw the network from above with ellipses."""
    figure = sheet(4.2)
    ax = axes(figure, 0.6, 0.5, WIDTH - 0.8, 3.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.plot(*network.odometry[:, :2].T, "--", color=ODOMETRY, linewidth=0.9)
    ax.plot(*network.stops[:, :2].T, color=FINAL, linewidth=1.0)
    for camera in network.cameras:
        colour = INK if camera.current else REJECTED
        ax.plot(*_ellipse(camera.pose[:2], camera.covariance[:2, :2]).T, color=WEAK, linewidth=1.1)
        ahead = camera.pose[:2] + 0.8 * rotation_matrix(camera.pose[3:])[:2, 2]
        ax.plot([camera.pose[0], ahead[0]], [camera.pose[1], ahead[1]], color=colour, linewidth=1.4)
        ax.plot(*camera.pose[:2], "s", color=colour, markersize=4)
        ax.annotate(
            camera.name,
            (camera.pose[0], camera.pose[1]),
            xytext=(5, 5),
            textcoords="offset points",
            fontsize=8.5,
            color=MUTED,
        )
    return figure


@drawn("How surprising each view was to the filter")
def surprises(network: NetworkMap) -> Figure:
    """Draw the squared Mahalanobis distances of the views in order of time."""
    figure = sheet(2.3)
    ax = axes(figure, 0.6, 0.5, WIDTH - 0.8, 1.6)
    ax.set_xlabel("view, in order of time")
    ax.set_ylabel("NIS, 6 dof")
    ax.set_yscale("log")
    nis, verdicts = network.views.nis, np.array(network.views.verdicts)
    for verdict, colour, marker in (("taken", ACCEPTED, "."), ("rejected", REJECTED, "x")):
        which = np.flatnonzero(verdicts == verdict)
        ax.plot(which, np.clip(nis[which], 0.05, 1e4), marker, color=colour, markersize=4)
    ax.axhline(22.46, color=LINE, linestyle="--", linewidth=1)
    ax.axhline(6, color=LINE, linewidth=1)
    return figure


@drawn("How well the corners of each camera fit")
def fits(network: NetworkMap) -> Figure:
    """Draw the chi-square per degree of freedom of each camera."""
    mapped = current(network)
    figure = sheet(2.2)
    ax = axes(figure, 0.6, 0.5, WIDTH - 0.8, 1.5)
    ax.set_ylabel("χ²/dof of corners")
    ax.set_xlabel("camera")
    values = [camera.chi_square_per_dof for camera in mapped]
    ax.bar(range(len(mapped)), values, color=[REJECTED if v > 2 else FINAL for v in values], width=0.7)
    ax.axhline(1, color=INK, linestyle="--", linewidth=1)
    step = max(1, len(mapped) // 12)
    ax.set_xticks(range(0, len(mapped), step), [camera.name for camera in mapped[::step]])
    return figure


def _seen(points: Array) -> Array:
    """Return points (..., 3) of space as points (..., 2) of the picture."""
    ca, sa, ce, se = math.cos(AZIMUTH), math.sin(AZIMUTH), math.cos(ELEVATION), math.sin(ELEVATION)
    right = np.array([-sa, ca, 0.0])
    up = np.array([-se * ca, -se * sa, ce])
    shown: Array = np.stack([points @ right, points @ up], axis=-1)
    return shown


def _floor(ax: Axes, network: NetworkMap) -> None:
    places = np.concatenate([network.stops[:, :2], [camera.pose[:2] for camera in network.cameras]])
    (left, bottom), (right, top) = places.min(axis=0) - 1, places.max(axis=0) + 1
    step = max(1.0, 10 ** math.floor(math.log10(max(right - left, top - bottom))) / 2)
    for x in np.arange(math.floor(left / step) * step, right + step, step):
        ax.plot(*_seen(np.array([[x, bottom, 0.0], [x, top, 0.0]])).T, color=LINE, linewidth=0.5)
    for y in np.arange(math.floor(bottom / step) * step, top + step, step):
        ax.plot(*_seen(np.array([[left, y, 0.0], [right, y, 0.0]])).T, color=LINE, linewidth=0.5)


def _camera(ax: Axes, camera: MappedCamera) -> None:
    centre, colour = camera.pose[:3], INK if camera.current else REJECTED
    w, h = camera.camera.width / camera.camera.parameters[0] / 2, camera.camera.height / camera.camera.parameters[1] / 2
    corners = np.array([[-w, -h, 1], [w, -h, 1], [w, h, 1], [-w, h, 1], [-w, -h, 1]]) * FRUSTUM
    edge = _seen(corners @ rotation_matrix(camera.pose[3:]).T + centre)
    ax.plot(*edge.T, color=colour, linewidth=0.9)
    tip = _seen(centre)
    for corner in edge[:4]:
        ax.plot(*np.array([tip, corner]).T, color=colour, linewidth=0.9)
    ax.plot(*_seen(np.array([centre, [centre[0], centre[1], 0.0]])).T, ":", color=MUTED, linewidth=0.7)
    turn = np.array([_seen(np.eye(3)[k]) for k in range(3)]).T
    ax.plot(*_ellipse(tip, turn @ camera.covariance[:3, :3] @ turn.T).T, color=WEAK, linewidth=1.1)
    ax.annotate(camera.name, (tip[0], tip[1]), xytext=(4, 6), textcoords="offset points", fontsize=8.5, color=MUTED)


def _ellipse(centre: Array, covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    turn = np.linspace(0, 2 * np.pi, 61)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    shape: Array = (centre[:, None] + SIGMAS * vectors @ (np.sqrt(np.maximum(values, 0))[:, None] * circle)).T
    return shape
