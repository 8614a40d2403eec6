"""Surveys of camera networks through the command line: folder in, map out, and what goes wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PIL import Image

from findings_shown import findings_shown
from groma.cameras.network import NetworkMapper
from groma.cameras.survey import open_network, read_covariance, write_network
from groma.cli import run
from groma.errors import EstimationError, UserError
from groma.io.kalibr_camchain import read_camchain
from groma.io.network_file import read_network
from groma.nouns.arrays import Gray
from groma.nouns.detection import Detection
from groma.nouns.network import NetworkMap
from groma.nouns.poses import rotation_matrix
from groma.report.network.words import network_verdict, weak_directions
from groma.simulation.network import SimulatedNetwork, network_scene, simulate_network
from groma.simulation.rendered_network import rendered_messages


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("network") / "survey"
    assert run(["simulate", "cameras", "loop", "-o", str(folder), "--seed", "2"]) == 0
    return folder


def mapped(simulated: SimulatedNetwork, **settings: object) -> NetworkMap:
    mapper = NetworkMapper(simulated.scene.target, simulated.scene.known())
    for message, stop in simulated.messages():
        mapper.push(message, stop)
    return mapper.finish({**simulated.scene.settings(), **settings})


def test_a_simulated_survey_is_mapped_close_to_its_truth(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(["cameras", "map", str(survey), "-o", str(out), "--config", str(survey / "settings.toml")]) == 0
    cameras, joint = read_network(out / "network.json")
    truth = json.loads((survey / "truth.json").read_text())["cameras"]
    assert joint is not None
    assert joint.shape == (48, 48)
    errors = np.array([c.pose[:3] - truth[c.name]["position"] for c in cameras])
    sigmas = np.array([np.sqrt(np.trace(c.covariance[:3, :3])) for c in cameras])
    assert (np.linalg.norm(errors, axis=1) < 4 * sigmas).all()
    assert np.linalg.norm(errors, axis=1).max() < 0.5
    page = (out / "report.html").read_text()
    assert "8 cameras mapped" in page
    assert "Height: on a level floor the height of the target is unobservable" in page
    assert {path.name for path in (out / "cameras").iterdir()} == {f"camera{k}.yaml" for k in range(1, 9)}
    assert len(read_camchain(out / "camchain.yaml")) == 8
    assert (out / "network.urdf").read_text().count("<joint") == 8
    assert (out / "static_transforms.txt").read_text().count("static_transform_publisher") == 8


def test_two_runs_give_the_same_bytes(survey: Path, tmp_path: Path) -> None:
    for name in "ab":
        assert run(["cameras", "map", str(survey), "-o", str(tmp_path / name)]) == 0
    for path in (tmp_path / "a").rglob("*"):
        if path.is_file() and path.name != "run.toml":
            assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()


def test_images_give_the_map_of_the_detections_in_them(tmp_path: Path) -> None:
    scene = network_scene("corridor", 1)
    simulated = simulate_network(msgspec.structs.replace(scene, stops=scene.stops[:8], cameras=scene.cameras[:2]))

    def keep(camera: str, stop: int, image: Gray) -> None:
        folder = tmp_path / "survey" / "images" / camera
        folder.mkdir(parents=True, exist_ok=True)
        Image.fromarray(image).save(folder / f"{simulated.stop_times[stop].mean():.3f}.png")

    messages = list(rendered_messages(simulated, keep=keep))
    survey, out = tmp_path / "survey", (tmp_path / "a", tmp_path / "b")
    write_network(survey, scene.target, simulated.scene.known(), iter(messages))
    assert run(["cameras", "map", str(survey), "-o", str(out[0])]) == 0
    (survey / "detections.jsonl").unlink()
    assert run(["cameras", "map", str(survey), "-o", str(out[1])]) == 0
    said, seen = (read_network(folder / "network.json")[0] for folder in out)
    assert len(said) == len(seen) > 0
    for a, b in zip(said, seen, strict=True):
        assert a.pose == pytest.approx(b.pose, abs=1e-9)
    Image.new("L", (640, 480)).save(survey / "images" / "camera1" / "first.png")
    assert run(["cameras", "map", str(survey), "-o", str(out[1])]) == 2


def test_the_order_of_messages_and_repetition_do_not_matter() -> None:
    simulated = simulate_network(network_scene("loop", 4))
    straight = mapped(simulated)
    mapper = NetworkMapper(simulated.scene.target, simulated.scene.known())
    for message, stop in [*reversed(list(simulated.messages())), *simulated.messages()]:
        mapper.push(message, stop)
    again = mapper.finish(simulated.scene.settings())
    assert straight.joint is not None
    assert again.joint is not None
    assert straight.joint.tobytes() == again.joint.tobytes()


def test_a_live_map_grows_with_the_messages() -> None:
    simulated = simulate_network(network_scene("corridor", 4))
    mapper = NetworkMapper(simulated.scene.target, simulated.scene.known())
    messages = sorted(simulated.messages(), key=lambda pair: pair[0].stamp)
    half = len(messages) // 2
    for message, stop in messages[:half]:
        mapper.push(message, stop)
    first = mapper.finish(simulated.scene.settings())
    for message, stop in messages[half:]:
        mapper.push(message, stop)
    whole = mapper.finish(simulated.scene.settings())
    assert 0 < len(first.cameras) < len(whole.cameras) == 7
    assert first.unseen
    assert whole.unseen == ()


def test_a_camera_that_was_hit_is_told_and_mapped_anew() -> None:
    scene = network_scene("laps", 3)
    bump = {"camera": "camera4", "stop": 60, "motion": [0.05, 0.0, 0.02, 0.0, 0.05, 0.0]}
    scene = msgspec.convert({**msgspec.to_builtins(scene), "bump": bump}, type(scene))
    network = mapped(simulate_network(scene))
    assert [name for name, _, _ in network.moved] == ["camera4"]
    assert "camera4 moved during the survey and was mapped again" in network_verdict(network)
    told = next(found for found in network.findings if found.code == "camera-moved")
    assert "camera4 was moved during the survey, by " in told.text
    assert told.values["turn"][0] == pytest.approx(0.05, abs=0.02)
    _, old, new = network.moved[0]
    assert not network.cameras[old].current
    assert network.cameras[new].current
    moved = np.linalg.norm(network.cameras[new].pose[:3] - network.cameras[old].pose[:3])
    assert moved == pytest.approx(0.054, abs=0.08)


def test_a_height_with_a_sigma_is_shared_by_all_cameras() -> None:
    simulated = simulate_network(network_scene("loop", 1))
    network = mapped(simulated, mount={"position": 0.0, "height": 0.02, "rotation": 0.0})
    sigmas = [np.sqrt(camera.covariance[2, 2]) for camera in network.cameras]
    assert network.joint is not None
    assert 0.015 < min(sigmas) < max(sigmas) < 0.021
    assert network.joint[2, 8] / (sigmas[0] * sigmas[1]) > 0.9
    assert "is common to all cameras" in weak_directions(network)[0]


def test_true_lenses_and_rotations_are_those_of_the_scene() -> None:
    simulated = simulate_network(network_scene("corridor", 1))
    axis = rotation_matrix(simulated.cameras[0, 3:])[:, 2]
    camera = simulated.scene.cameras[0]
    assert axis == pytest.approx([np.cos(camera.heading) * np.cos(camera.down), 0.0, -np.sin(camera.down)], abs=1e-9)
    assert simulated.lenses == tuple(c.camera for c in simulated.scene.cameras)


def lines(survey: Path, tmp_path: Path, change: str) -> Path:
    copy = tmp_path / "copy"
    (copy / "cameras").mkdir(parents=True)
    for path in survey.rglob("*"):
        if path.is_file():
            (copy / path.relative_to(survey)).write_bytes(path.read_bytes())
    detections = copy / "detections.jsonl"
    detections.write_text(change + "\n" + detections.read_text())
    return copy


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ('{"stamp":1', "Input data was truncated"),
        ('{"stamp":1,"camera":"a","panel":"b","ids":[1],"u":[1],"v":[1,2],"sigma":1}', "1 ids for 1 u, 2 v"),
        ('{"stamp":1,"camera":"a","panel":"b","ids":[1],"u":[1],"v":[1],"sigma":-1}', "sigma"),
        ('{"stamp":NaN}', "malformed"),
    ],
)
def test_a_malformed_line_is_told_and_left_out(survey: Path, tmp_path: Path, line: str, told: str) -> None:
    recording = open_network(lines(survey, tmp_path, line))
    count = sum(isinstance(message, Detection) for message, _ in recording.messages())
    assert count == sum(isinstance(message, Detection) for message, _ in open_network(survey).messages())
    assert recording.notes.malformed == 1
    assert "detections.jsonl:1" in recording.notes.examples[0]
    assert told in recording.notes.examples[0]


def test_findings_of_a_survey_are_the_same_everywhere(
    survey: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spoiled, out = lines(survey, tmp_path, '{"stamp":NaN}'), tmp_path / "out"
    settings = survey / "settings.toml"
    capsys.readouterr()
    assert run(["cameras", "map", str(spoiled), "--config", str(settings), "-o", str(out)]) == 0
    assert "records-malformed" in findings_shown(out, capsys.readouterr().err)


def test_detections_of_unknown_cameras_and_panels_are_counted() -> None:
    simulated = simulate_network(network_scene("loop", 1))
    mapper = NetworkMapper(simulated.scene.target, simulated.scene.known())
    for message, stop in simulated.messages():
        mapper.push(message, stop)
    _, detection = simulated.detections[0]
    mapper.push(replace(detection, camera="stranger"))
    mapper.push(replace(detection, panel="stranger"))
    mapper.push(replace(detection, pixels=np.full_like(detection.pixels, np.nan)))
    counts = mapper.finish().counts
    assert sum(value for key, value in counts.items() if key.startswith("left out")) == 3


@pytest.mark.parametrize(
    ("spoil", "code", "told"),
    [
        (lambda s: (s / "odometry.csv").unlink(), 2, "0 files odometry.*"),
        (lambda s: (s / "target.toml").write_text("[[panel]]\n"), 2, "target.toml"),
        (lambda s: [p.unlink() for p in (s / "cameras").glob("*.yaml")], 2, "no NAME.yaml"),
        (lambda s: (s / "cameras" / "camera1.yaml").write_text("image_width: 3"), 2, "camera1.yaml"),
        (lambda s: (s / "cameras" / "camera1.json").write_text("{}"), 2, "camera1.json"),
        (lambda s: (s / "detections.jsonl").write_text(""), 1, "no camera saw the target"),
        (lambda s: (s / "odometry.csv").write_text("# groma csv 1\n"), 1, "no odometry"),
    ],
)
def test_bad_surveys_are_refused_in_one_line(
    survey: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    spoil: Callable[[Path], object],
    code: int,
    told: str,
) -> None:
    copy = lines(survey, tmp_path, "")
    spoil(copy)
    assert run(["cameras", "map", str(copy), "-o", str(tmp_path / "out")]) == code
    error = capsys.readouterr().err.splitlines()
    assert told in error[0]
    assert code == 1 or len(error) == 1
    left = {path.name for path in tmp_path.glob("out/*")}
    assert left == ({"metrics.json", "report.html", "run.toml"} if code == 1 else set())


def test_a_missing_folder_and_wrong_settings_are_the_users_mistakes(survey: Path, tmp_path: Path) -> None:
    assert run(["cameras", "map", str(tmp_path / "none")]) == 2
    config = tmp_path / "config.toml"
    config.write_text("[cameras]\ngate = 1.5\n")
    assert run(["cameras", "map", str(survey), "-o", str(tmp_path / "out"), "--config", str(config)]) == 2
    config.write_text("[cameras]\ngates = 0.5\n")
    assert run(["cameras", "map", str(survey), "-o", str(tmp_path / "out"), "--config", str(config)]) == 2
    with pytest.raises(UserError, match="no network is called"):
        network_scene("nowhere")


def test_a_covariance_that_is_none_is_refused(survey: Path, tmp_path: Path) -> None:
    camera = open_network(survey).cameras[0].camera
    path = tmp_path / "c.json"
    for text in (
        '{"version":2,"parameters":["fx"],"covariance":[[1]]}',
        '{"version":1,"parameters":["fx"],"covariance":[[-1]]}',
        '{"version":1,"parameters":["fx","q"],"covariance":[[1,0],[0,1]]}',
        '{"version":1,"parameters":["fx"],"covariance":[[1],[2]]}',
    ):
        path.write_text(text)
        with pytest.raises(UserError, match=r"c\.json"):
            read_covariance(path, camera)
    path.write_text('{"version":1,"parameters":["fy","fx"],"covariance":[[4,1],[1,9]]}')
    assert read_covariance(path, camera)[0, 0] == 9


def test_nothing_to_map_is_an_estimation_error() -> None:
    scene = network_scene("loop")
    with pytest.raises(EstimationError, match="odometry"):
        NetworkMapper(scene.target, scene.known()).finish()
    with pytest.raises(UserError, match="same name"):
        NetworkMapper(scene.target, (*scene.known(), scene.known()[0]))
