"""An inspection as tables of text for people, and as JSON with stable keys for programs.

JSON has no infinity and no NaN: both become null.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from groma.io.notes import fence_post
from groma.io.streams import Kind
from groma.recordings.inspection import Inspection, OdometryStream, ScanStream, Timing
from groma.report.finding_lines import in_order, line
from groma.report.outcome import finding_json


@dataclass(frozen=True, slots=True)
class Section:
    """A title, then a table (its first row is the head) or sentences."""

    title: str
    rows: list[tuple[str, ...]] = field(default_factory=list)
    sentences: list[str] = field(default_factory=list)


def sections(found: Inspection) -> Iterator[Section]:
    """Yield the sections of the report in reading order, empty ones left out."""
    duration = "duration unknown" if math.isnan(found.duration_s) else f"{found.duration_s:.1f} s"
    yield Section(f"{found.path}: {found.format}, {duration}")
    head = ("stream", "kind", "messages", "first [s]", "last [s]", "rate [Hz]", "longest gap [s]", "order")
    rows = [_timing_row(name, kind, timing) for (name, kind), timing in found.timings.items()]
    tables: dict[str, tuple[tuple[str, ...], list[tuple[str, ...]]]] = {
        "Streams": (head, rows),
        "Scans": (
            (
                "stream",
                "frame",
                "beams",
                "fan [deg]",
                "step [deg]",
                "range [m]",
                "hits",
                "no return",
                "invalid",
                "intensities",
            ),
            [_scan_row(name, scan) for name, scan in found.scans.items() if scan.geometry],
        ),
        "Odometry": (
            ("stream", "frames", "path [m]", "turned [rad]", "largest step [m]", "jumps"),
            [_odometry_row(name, odometry) for name, odometry in found.odometry.items()],
        ),
        "Joints": (("stream", "names"), [(name, ", ".join(names)) for name, names in found.joints.items()]),
        "Frames": (
            ("parent", "child", ""),
            [(parent, child, "static" if static else "moving") for (parent, child), static in found.edges.items()],
        ),
    }
    for title, (first, rest) in tables.items():
        if rest:
            yield Section(title, [first, *rest])
    if found.drive:
        yield Section("A map would be made of", sentences=found.drive)
    if found.findings:
        yield Section("Findings", sentences=[line(finding) for finding in in_order(found.findings)])
    uses = [(use.command, "yes" if use.possible else "no", use.why) for use in found.uses]
    yield Section("Serves", [("command", "", ""), *uses])


def as_json(found: Inspection) -> dict[str, Any]:
    """Return the inspection as plain values with stable keys."""
    return {
        "path": found.path,
        "format": found.format,
        "duration_s": _number(found.duration_s),
        "streams": [_timing_json(name, kind, timing) for (name, kind), timing in found.timings.items()],
        "scans": [_scan_json(name, scan, found) for name, scan in found.scans.items()],
        "odometry": [_odometry_json(name, odometry) for name, odometry in found.odometry.items()],
        "joints": [{"stream": name, "names": list(names)} for name, names in found.joints.items()],
        "frames": [{"parent": p, "child": c, "static": static} for (p, c), static in found.edges.items()],
        "drive": found.drive,
        "findings": [finding_json(finding) for finding in in_order(found.findings)],
        "uses": [{"command": use.command, "possible": use.possible, "why": use.why} for use in found.uses],
    }


def _order(timing: Timing) -> str:
    faults = [
        (timing.backward, f"{timing.backward} back (up to {timing.largest_back_s:.3g} s)"),
        (timing.repeats, f"{timing.repeats} repeated"),
    ]
    return ", ".join(text for count, text in faults if count) or "ok"


def _timing_row(name: str, kind: Kind, timing: Timing) -> tuple[str, ...]:
    gap = f"{timing.longest_gap_s:.3g}" if timing.has_gap else "none"
    order = "" if kind is Kind.TRANSFORM else _order(timing)  # edges of one topic need no common order
    rate = "" if math.isnan(timing.rate_hz) else f"{timing.rate_hz:.3g}"
    return (name, kind, str(timing.count), f"{timing.first:.3f}", f"{timing.last:.3f}", rate, gap, order)


def _scan_row(name: str, scan: ScanStream) -> tuple[str, ...]:
    g = scan.geometry
    assert g is not None  # noqa: S101 (asked by the caller)
    last = g.angle_min + (max(scan.beams) - 1) * g.angle_increment
    return (
        name,
        scan.frame,
        "/".join(map(str, sorted(scan.beams)[:3])) + (" .." if len(scan.beams) > 3 else ""),
        f"{math.degrees(g.angle_min):.5g} .. {math.degrees(last):.5g}",
        f"{math.degrees(g.angle_increment):.4g}" + (" (varies)" if scan.geometries_differ else ""),
        f"{g.range_min:.3g} .. {g.range_max:.5g}",
        _share(scan.hits, scan.readings),
        _share(scan.no_returns, scan.readings),
        _share(scan.invalid, scan.readings),
        "yes" if scan.with_intensities else "no",
    )


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else ""


def _odometry_row(name: str, odometry: OdometryStream) -> tuple[str, ...]:
    return (
        name,
        f"{odometry.frame} -> {odometry.child_frame}",
        f"{odometry.path_m:.1f}",
        f"{odometry.turned_rad:.1f}",
        f"{odometry.largest_step_m:.3g}",
        str(odometry.jumps),
    )


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _timing_json(name: str, kind: Kind, timing: Timing) -> dict[str, Any]:
    return {
        "stream": name,
        "kind": str(kind),
        "count": timing.count,
        "first_s": _number(timing.first),
        "last_s": _number(timing.last),
        "rate_hz": _number(timing.rate_hz),
        "longest_gap_s": timing.longest_gap_s,
        "backward_steps": timing.backward,
        "largest_backward_step_s": timing.largest_back_s,
        "repeated_stamps": timing.repeats,
    }


def _scan_json(name: str, scan: ScanStream, found: Inspection) -> dict[str, Any]:
    g = scan.geometry
    excess = found.angle_max_excess.get(name)
    return {
        "stream": name,
        "frame": scan.frame,
        "beams": sorted(scan.beams),
        "angle_min_rad": _number(g.angle_min) if g else None,
        "angle_increment_rad": _number(g.angle_increment) if g else None,
        "time_increment_s": _number(g.time_increment) if g else None,
        "range_min_m": _number(g.range_min) if g else None,
        "range_max_m": _number(g.range_max) if g else None,
        "geometry_varies": scan.geometries_differ,
        "angle_max_excess_beams": excess,
        "angle_max_remark": None if excess is None else fence_post(excess),
        "readings": scan.readings,
        "hits": scan.hits,
        "no_returns": scan.no_returns,
        "invalid": scan.invalid,
        "longest_hit_m": scan.longest_hit_m,
        "scans_with_intensities": scan.with_intensities,
    }


def _odometry_json(name: str, odometry: OdometryStream) -> dict[str, Any]:
    return {
        "stream": name,
        "frame": odometry.frame,
        "child_frame": odometry.child_frame,
        "path_m": _number(odometry.path_m),
        "turned_rad": _number(odometry.turned_rad),
        "largest_step_m": _number(odometry.largest_step_m),
        "jumps": odometry.jumps,
    }
