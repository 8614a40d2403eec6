"""`groma calibrate camera`: rendered images in, a camera out; and what users get wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from camera_scenes import CAMERA, TARGET, Array, poses, write_images
from findings_shown import findings_shown
from groma.cameras.calibration import calibrate_camera, projection_sigmas
from groma.cli import run
from groma.errors import EstimationError, UserError
from groma.io.camera_info import read_camera_info
from groma.io.kalibr_camchain import read_camchain
from groma.io.panels import write_panels
from groma.io.target_file import read_target
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.target import Chessboard, Panel, Target

KALIBR = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.08\ntagSpacing: 0.3\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("camera")
    write_images(directory / "images", poses(9, seed=4))
    (directory / "images" / "notes.txt").write_text("no image")
    (directory / "images" / "cut.png").write_bytes((directory / "images" / "view0.png").read_bytes()[:900])
    (directory / "target.yaml").write_text(KALIBR)
    return directory


def _run(folder: Path, *more: str) -> int:
    return run(["calibrate", "camera", str(folder / "images"), "--target", str(folder / "target.yaml"), *more])


def test_images_in_a_camera_out(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert _run(folder, "--name", "door", "-o", str(out)) == 0
    shown = capsys.readouterr()
    assert "Projection uncertainty" in shown.out
    assert "cut.png: cannot be read as an image" in shown.err
    findings_shown(out, shown.err)
    name, found = read_camera_info(out / "door.yaml")
    assert name == "door"
    metrics = json.loads((out / "metrics.json").read_text())
    errors = (np.array(found.parameters[:8]) - CAMERA.parameters) / list(metrics["sigma"].values())
    assert np.abs(errors).max() < 5
    assert metrics["sigma"]["fx"] < 2
    assert metrics["images"] == 9
    assert 0.01 < metrics["rms_px"] < 0.1
    kept = json.loads((out / "door.json").read_text())
    assert (kept["version"], kept["parameters"][:2]) == (1, ["fx", "fy"])
    assert read_camchain(out / "camchain.yaml")["door"].parameters == tuple(kept["values"])
    page = (out / "report.html").read_text()
    assert "Check of the covariance" in page
    assert "<script" not in page


def test_the_second_run_is_the_same_and_looks_at_no_image_twice(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    assert _run(folder, "-o", str(out)) == 0
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    assert any(name.startswith("detections-") for name in first)
    monkeypatch.setattr("groma.cameras.images.detect", lambda *_, **__: pytest.fail("looked again"))
    assert _run(folder, "-o", str(out)) == 0
    assert {path.name: path.read_bytes() for path in out.iterdir()} == first


def test_a_broken_cache_is_made_anew(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert _run(folder, "-o", str(out)) == 0
    (cache,) = out.glob("detections-*.json")
    whole = cache.read_bytes()
    cache.write_bytes(whole[: len(whole) // 2])
    assert _run(folder, "-o", str(out)) == 0
    assert cache.read_bytes() == whole


def test_a_panel_that_only_moved_is_refused_with_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    start = poses(1, seed=1)[0]
    places = [start.copy() for _ in range(6)]
    for k, place in enumerate(places):
        place[0, 3] += 0.03 * k - 0.08
    write_images(tmp_path / "images", places)
    (tmp_path / "target.yaml").write_text(KALIBR)
    assert _run(tmp_path, "-o", str(tmp_path / "out")) == 1
    assert "faces the same way in all 6 views" in capsys.readouterr().err
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"metrics.json", "report.html", "run.toml"}


def _mixed(directory: Path) -> None:
    Image.new("L", (64, 48), 128).save(directory / "a.png")
    Image.new("L", (48, 64), 128).save(directory / "b.png")


@pytest.mark.parametrize(
    ("fill", "code", "message"),
    [
        (lambda _: None, 2, "no image in it"),
        (lambda d: (d / "a.png").write_bytes(b"nothing"), 2, "no image in it that can be read"),
        (_mixed, 2, "a.png is 64 x 48 and b.png is 48 x 64"),
        (lambda d: Image.new("L", (64, 48), 128).save(d / "a.png"), 1, "the target is in none of 1 images"),
    ],
)
def test_folders_that_hold_no_calibration_get_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], fill: object, code: int, message: str
) -> None:
    (tmp_path / "images").mkdir()
    assert callable(fill)
    fill(tmp_path / "images")
    (tmp_path / "target.yaml").write_text(KALIBR)
    assert _run(tmp_path, "-o", str(tmp_path / "out")) == code
    told = capsys.readouterr().err.splitlines()
    assert message in told[0]
    assert told[0].startswith("groma: " if code == 2 else "error: no-estimate: ")


def test_what_is_not_there_or_named_badly_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "target.yaml").write_text(KALIBR)
    assert _run(tmp_path) == 2
    assert "there is no such folder or file" in capsys.readouterr().err
    assert _run(tmp_path, "--name", "../door") == 2
    assert "letters, digits" in capsys.readouterr().err
    (tmp_path / "images").mkdir()
    (tmp_path / "config.toml").write_text("[camera]\nlens = 'radtan'\nsplit = 3\n")
    assert _run(tmp_path, "--config", str(tmp_path / "config.toml")) == 2
    assert "unknown setting camera.split" in capsys.readouterr().err


def _perfect(camera: Camera, target: Target, places: list[Array]) -> list[Detection]:
    seen = []
    for k, place in enumerate(places):
        corners = target.panels[0].corners
        pixels = camera.project(corners @ place[:3, :3].T + place[:3, 3])
        inside = np.isfinite(pixels).all(axis=1) & camera.holds(np.nan_to_num(pixels, nan=-9.0))
        ids = np.flatnonzero(inside)
        seen.append(Detection(float(k), "camera", target.panels[0].name, ids, pixels[ids], np.full(len(ids), 0.3)))
    return seen


def test_corners_without_noise_give_the_camera_back() -> None:
    found = calibrate_camera((640, 480), TARGET, _perfect(CAMERA, TARGET, poses(8, seed=5)))
    assert found.camera.parameters == pytest.approx(CAMERA.parameters, rel=1e-6, abs=1e-7)
    assert found.views[0].pose == pytest.approx(poses(8, seed=5)[0], abs=1e-7)
    pixels, sigmas = projection_sigmas(found.camera, found.claimed)
    assert pixels.shape == (*sigmas.shape, 2)
    assert sigmas.max() < 1e-3


def test_settings_and_views_that_make_no_sense_are_refused() -> None:
    seen = _perfect(CAMERA, TARGET, poses(8, seed=5))
    with pytest.raises(UserError, match="setting of camera"):
        calibrate_camera((640, 480), TARGET, seen, {"lens": "glass"})
    with pytest.raises(EstimationError, match="2 usable views of a panel"):
        calibrate_camera((640, 480), TARGET, seen[:2])
    with pytest.raises(EstimationError, match="0 usable views"):
        calibrate_camera((640, 480), TARGET, [])


@pytest.mark.shared
def test_the_chessboard_of_opencv_gives_the_published_camera(shared: Path) -> None:
    """On OpenCV's own corners, none left out: left_intrinsics.yml and a run of OpenCV 4.14 on these corners."""
    table = np.genfromtxt(
        shared / "data/camera/derived_corners/opencv_left_chessboard.csv",
        delimiter=",",
        names=True,
        dtype=None,
        encoding="utf-8",
    )
    target = Target((Panel("board", Chessboard(9, 6, 0.025)),))
    seen = []
    for k, image in enumerate(np.unique(table["image"])):
        rows = table[table["image"] == image]
        pixels = np.column_stack([rows["u_px"], rows["v_px"]])
        seen.append(
            Detection(float(k), "left", "board", rows["corner"].astype(np.int64), pixels, np.full(len(rows), 0.3))
        )
    found = calibrate_camera((640, 480), target, seen, {"lens": "plumb_bob", "rejection": 1e6})
    assert found.camera.parameters[:2] == pytest.approx((535.92, 535.92), abs=1.0)
    assert found.camera.parameters[2:4] == pytest.approx((342.37, 235.59), abs=0.5)
    assert found.rms == pytest.approx(0.408, abs=0.02)
    assert found.rms == pytest.approx(0.3926, abs=0.02)
    assert found.honesty.factor is not None
    assert 1.2 < found.honesty.factor < 3.0


def test_panels_of_groma_serve_as_well(folder: Path, tmp_path: Path) -> None:
    write_panels(tmp_path / "panels.toml", TARGET)
    assert read_target(tmp_path / "panels.toml").panels[0].pattern == TARGET.panels[0].pattern
    arguments = ["calibrate", "camera", str(folder / "images"), "--target", str(tmp_path / "panels.toml")]
    assert run([*arguments, "-o", str(tmp_path / "out")]) == 0
