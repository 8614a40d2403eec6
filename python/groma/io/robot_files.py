"""What a calibrated vehicle means to ROS: the `<origin>` of its laser for a URDF, parameters for ros2_control.

Fields are those of `tricycle_controller` and `diff_drive_controller` (their parameter files in ros2_controllers). What
a controller has no field for stands as a comment that says what to do with it. Controllers take lengths that are
positive: a wheel that counts backward, or wheels that are swapped, are reported in a comment, and lengths have no sign.
"""

from __future__ import annotations

import math

from groma.nouns.vehicle import Vehicle


def urdf_joint(vehicle: Vehicle, base: str = "base_link", laser: str = "laser") -> str:
    """Return a fixed joint with the pose of the laser.

    Parameters
    ----------
    vehicle
        Calibrated.
    base, laser
        Names of the links.
    """
    x, y, yaw = vehicle.laser
    return (
        f'<joint name="{laser}_joint" type="fixed">\n'
        f'  <parent link="{base}"/>\n'
        f'  <child link="{laser}"/>\n'
        f"  <!-- height, roll and pitch do not show in planar motion: keep yours -->\n"
        f'  <origin xyz="{x:.6f} {y:.6f} 0" rpy="0 0 {yaw:.8f}"/>\n'
        "</joint>\n"
    )


def ros2_control(vehicle: Vehicle) -> str:
    """Return the parameters of the controller as YAML."""
    lines = _differential(vehicle) if vehicle.model == "differential" else _tricycle(vehicle)
    wiring = [f"# Fix first: {finding.text}. {finding.remedy}" for finding in vehicle.handedness()]
    return "\n".join([*wiring, *lines]) + "\n"


def _tricycle(vehicle: Vehicle) -> list[str]:
    p = vehicle.parameters
    traction, steering = vehicle.joints or ("traction_joint", "steering_joint")
    lines = [
        "tricycle_controller:",
        "  ros__parameters:",
        f"    traction_joint_name: {traction}",
        f"    steering_joint_name: {steering}",
        f"    wheelbase: {abs(p['wheelbase']):.6f}",
        *_behind(p["wheelbase"]),
        *_radius(vehicle, "wheel_radius", abs(p["drive_scale"])),
        "# The controller knows no steering offset and no gain: let the driver of the encoder give out",
    ]
    gain = f"{p['steering_gain']:.8g} * angle" if p["steering_gain"] != 1.0 else "angle"
    if vehicle.model == "tricycle":
        return [*lines, f"#   {gain} + ({_radians(p['steering_offset'])})"]
    forward, backward = p["steering_offset_forward"], p["steering_offset_backward"]
    return [
        *lines,
        f"#   {gain} + ({_radians(forward)}) driving forward",
        f"#   {gain} + ({_radians(backward)}) driving backward",
        f"# or, with one offset for both, {_radians((forward + backward) / 2)}.",
    ]


def _differential(vehicle: Vehicle) -> list[str]:
    p = vehicle.parameters
    radii, axle = (abs(p["left_radius"]), abs(p["right_radius"])), abs(p["axle"])
    left, right = vehicle.joints or ("left_wheel_joint", "right_wheel_joint")
    head = ["diff_drive_controller:", "  ros__parameters:"]
    if not vehicle.joints:
        return [
            *head,
            "    # made from odometry: factors on the wheel radius that made it",
            f"    wheel_separation: {axle:.6f}",
            f"    left_wheel_radius_multiplier: {radii[0]:.8f}",
            f"    right_wheel_radius_multiplier: {radii[1]:.8f}",
        ]
    mean = sum(radii) / 2
    return [
        *head,
        f"    left_wheel_names: [{left}]",
        f"    right_wheel_names: [{right}]",
        f"    wheel_separation: {axle:.6f}",
        *_radius(vehicle, "wheel_radius", mean),
        "    wheel_separation_multiplier: 1.0",
        f"    left_wheel_radius_multiplier: {radii[0] / mean:.8f}",
        f"    right_wheel_radius_multiplier: {radii[1] / mean:.8f}",
    ]


def _behind(wheelbase: float) -> list[str]:
    return (
        []
        if wheelbase > 0
        else ["    # the steered wheel is behind the fixed axle: the controller takes it to be ahead"]
    )


def _radius(vehicle: Vehicle, name: str, scale: float) -> list[str]:
    if vehicle.unit == "rad":
        return [f"    {name}: {scale:.8f}"]
    return [f"    # {name}: {scale:.8g} m per count * counts per turn / (2 pi): fill in the counts per turn"]


def _radians(angle: float) -> str:
    return f"{angle:.8f} rad, {math.degrees(angle):.4f} deg"
