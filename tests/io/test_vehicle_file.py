"""vehicle.toml: what is written reads back exactly, and what describes no vehicle is reported in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.toml import to_toml
from groma.io.vehicle_file import read_vehicle, vehicle_text, write_vehicle
from groma.nouns.vehicle import PARAMETERS, Model, Scanner, Vehicle, WheelNoise, usual_noise

MODELS: tuple[Model, ...] = ("tricycle", "tricycle-asymmetric", "differential")


def vehicle(model: Model = "tricycle") -> Vehicle:
    """A vehicle with awkward numbers: thirds, and variances of many orders."""
    random = np.random.default_rng(4)
    names = PARAMETERS[model][:3]
    root = random.normal(size=(3, 3)) * np.array([1e-7, 1e-4, 1e-3])[:, None]
    values = {name: float(k + 1) / 3 for k, name in enumerate(PARAMETERS[model])}
    return Vehicle(model, values, names, root @ root.T, "tick", ("first joint", "second/joint"))


@pytest.mark.parametrize("model", MODELS)
def test_a_vehicle_reads_back_exactly(model: Model, tmp_path: Path) -> None:
    write_vehicle(tmp_path / "vehicle.toml", vehicle(model))
    read = read_vehicle(tmp_path / "vehicle.toml")
    assert vehicle_text(read) == vehicle_text(vehicle(model))
    assert read.parameters == vehicle(model).parameters
    assert np.array_equal(read.covariance, vehicle(model).covariance)
    assert (read.joints, read.unit, read.names) == (vehicle(model).joints, "tick", vehicle(model).names)


def test_a_file_may_be_written_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.toml"
    file.write_text(
        'version = 1\nmodel = "differential"\n[parameters]\nleft_radius = 0.1\nright_radius = 0.1\naxle = 1\n'
        "laser_x = 0.2\nlaser_y = 0\nlaser_yaw = 0.0\n"
    )
    read = read_vehicle(file)
    assert read.laser == (0.2, 0.0, 0.0)
    assert read.parameters["delay"] == 0.0
    assert read.sigma("axle") == 0.0


def test_the_standard_deviation_is_that_of_the_name() -> None:
    made = vehicle()
    assert made.sigma("wheelbase") == pytest.approx(np.sqrt(made.covariance[2, 2]))
    assert made.sigma("laser_x") == 0.0


WRONG = {
    "model = 3": "is not TOML",
    'version = 3\nmodel = "tricycle"': "version 3",
    'version = 2\nmodel = "tricycle"': "unknown key model",
    "version = 2": "[drive]",
    'version = 2\n[drive]\nmodel = "tricycle"': "[[scanners]]",
    'version = 1\nmodel = "unicycle"': "unicycle",
    'version = 1\nmodel = "tricycle"\nwheels = 3': "unknown key wheels",
    'version = 1\nmodel = "tricycle"\nunit = "turns"': "rad or tick",
    'version = 1\nmodel = "tricycle"\njoints = ["a"]': "traction and steering",
    'version = 1\nmodel = "tricycle"': "[parameters]",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_no_vehicle_is_one_line(text: str, tmp_path: Path) -> None:
    (tmp_path / "v.toml").write_text(text if text != "model = 3" else "model = = 3")
    with pytest.raises(UserError, match=r"^[^\n]*v\.toml: [^\n]*$") as told:
        read_vehicle(tmp_path / "v.toml")
    assert WRONG[text] in str(told.value)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("drive_scale = ", "wheel = ", "unknown parameter of a tricycle wheel"),
        ("\nx = ", "\n# x = ", "x is missing"),
        ("\nx = ", "\nx = nan #", "x is nan"),
        ("\nx = ", "\nx = true #", "x is True"),
        ("\nslip = ", "\nslip = -inf #", "slip is -inf"),
        ("\nslip = ", "\nslid = ", "unknown key of [noise] slid"),
        ("\nmemory = ", f"\nmemory = {10**400} #", "memory is 1000"),
        ("names = [", 'names = ["mass", ', "names: some of"),
        ("matrix = [[", "matrix = [[0.5, ", "3 rows of 3"),
        ("matrix = [[", "matrix = [[-", "covariance = -"),
    ],
)
def test_a_wrong_field_is_named(old: str, new: str, told: str, tmp_path: Path) -> None:
    text = vehicle_text(vehicle())
    assert old in text
    (tmp_path / "v.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(UserError, match=r"v\.toml") as error:
        read_vehicle(tmp_path / "v.toml")
    assert told in str(error.value)


NUMBERS = {
    "drive_scale": (0.0, 1e300, -1e300),
    "steering_offset": (1e300, -1e300),
    "wheelbase": (0.0, 1e300, 1e-300),
    "steering_gain": (0.0, 1e300),
    "delay": (1e300, -1e300),
    "slip": (-1.0, 1e300),
    "steering": (-1.0, 1e300),
    "memory": (0.0, -1.0, 1e300),
    "x": (1e300, -1e300),
    "y": (1e300,),
    "yaw": (1e300,),
    "range_offset": (1e300, -1e300),
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in NUMBERS.items() for value in values])
def test_a_number_out_of_range_is_named_in_one_line(name: str, value: float, tmp_path: Path) -> None:
    lines = vehicle_text(vehicle()).splitlines()
    (at,) = [k for k, line in enumerate(lines) if line.startswith(f"{name} = ")]
    lines[at] = f"{name} = {value!r}"
    (tmp_path / "v.toml").write_text("\n".join(lines))
    with pytest.raises(UserError, match=rf"^[^\n]*v\.toml: [^\n]*{name}[^\n]*must be[^\n]*$"):
        read_vehicle(tmp_path / "v.toml")


def test_a_file_of_version_1_is_the_same_vehicle(tmp_path: Path) -> None:
    made = vehicle("tricycle-asymmetric")
    old = {
        "version": 1,
        "model": made.model,
        "unit": made.unit,
        "joints": list(made.joints),
        "parameters": dict(made.parameters),
        "covariance": {"names": list(made.names), "matrix": made.covariance.tolist()},
    }
    (tmp_path / "old.toml").write_text(to_toml(old))
    read = read_vehicle(tmp_path / "old.toml")
    assert vehicle_text(read) == vehicle_text(made)
    assert read.noise == usual_noise()


def test_noise_and_scanners_read_back(tmp_path: Path) -> None:
    rear = Scanner("rear", -1.0, 0.1, 3.0)
    noise = WheelNoise(slip=0.002, steering=0.01, memory=1.0)
    made = replace(vehicle(), noise=noise, scanner="front", range_offset=0.03, others=(rear,))
    write_vehicle(tmp_path / "vehicle.toml", made)
    read = read_vehicle(tmp_path / "vehicle.toml")
    assert (read.noise, read.scanner, read.range_offset, read.others) == (noise, "front", 0.03, (rear,))
    assert read.laser == made.laser


def test_no_file_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        read_vehicle(tmp_path / "none.toml")


def test_a_vehicle_must_have_the_parameters_of_its_model() -> None:
    with pytest.raises(ValueError, match="axle"):
        Vehicle("differential", {"wheelbase": 1.0})
    with pytest.raises(ValueError, match="covariance"):
        Vehicle("tricycle", vehicle().parameters, ("wheelbase",), np.zeros((2, 2)))
