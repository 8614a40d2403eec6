"""A survey that came over the network: the map does not depend on how it came, nor on whether it was live."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from itertools import groupby, pairwise
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import numpy as np
import pytest
from msgspec.structs import replace
from PIL import Image

from groma.cameras.survey import LIVE, open_network, write_network
from groma.cli import run
from groma.io.camera_protocol import SITE, Detections, Numbered, Odometry, Stop, data_key, decode, encode
from groma.io.link_recording import Recorder, read_messages
from groma.link.itinerary import Itinerary
from groma.link.node import ROBOT
from groma.link.session import connect
from groma.link.sight import corners
from groma.nouns.building import Edge, Graph, Node
from groma.nouns.detection import Detection
from groma.simulation.network import SimulatedNetwork, network_scene, simulate_network

if TYPE_CHECKING:
    import zenoh


@pytest.fixture(scope="module")
def simulated() -> SimulatedNetwork:
    return simulate_network(network_scene("loop", 1))


@pytest.fixture(scope="module")
def survey(simulated: SimulatedNetwork, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("files") / "survey"
    write_network(folder, simulated.scene.target, simulated.scene.known(), simulated.messages())
    return folder


def sent(simulated: SimulatedNetwork) -> Iterator[Numbered]:
    """Yield what robot, survey and cameras would send, an image a camera and stamp."""
    for i, (stamp, x, y, theta) in enumerate(simulated.odometry.tolist()):
        yield Odometry(sender="robot", boot="r", sequence=i, stamp=stamp, x=x, y=y, theta=theta)
    for i, (begin, end) in enumerate(simulated.stop_times.tolist()):
        yield Stop(sender=ROBOT, boot="s", sequence=i, stop=i, stamp=(begin + end) / 2, standing=True)
    counts: dict[str, int] = {}
    seen = ((d, stop) for d, stop in simulated.messages() if isinstance(d, Detection))
    for (camera, _, stop), image in groupby(seen, key=lambda item: (item[0].camera, item[0].stamp, item[1])):
        counts[camera] = counts.get(camera, -1) + 1
        assert stop is not None
        yield Detections(
            sender=camera,
            boot="c",
            sequence=counts[camera],
            frame=counts[camera],
            survey="s",
            stop=stop,
            captured=0.0,
            clock_sigma=0.01,
            width=640,
            height=480,
            panels=tuple(corners(d) for d, _ in image),
        )


def record(survey: Path, folder: Path, messages: list[Numbered]) -> Path:
    """Make a survey with a recording of messages that arrive in this order."""
    shutil.copytree(survey, folder)
    (folder / "odometry.csv").unlink()
    (folder / "detections.jsonl").unlink()
    recorder = Recorder(folder / LIVE)
    for arrival, message in enumerate(messages):
        assert isinstance(message, Odometry | Stop | Detections)
        recorder.write(data_key("site", message.sender), message, encode(message), float(arrival))
    recorder.close()
    return folder


def mapped(folder: Path, output: Path) -> bytes:
    assert run(["cameras", "map", str(folder), "-o", str(output)]) == 0
    return (output / "network.json").read_bytes()


def test_the_map_does_not_depend_on_the_order_of_arrival_nor_on_repetitions(
    simulated: SimulatedNetwork, survey: Path, tmp_path: Path
) -> None:
    messages = list(sent(simulated))
    shuffled = [m for m in messages for _ in range(2)]
    Random(1).shuffle(shuffled)  # noqa: S311
    straight = mapped(record(survey, tmp_path / "straight", messages), tmp_path / "a")
    assert straight == mapped(record(survey, tmp_path / "shuffled", shuffled), tmp_path / "b")


def test_a_live_recording_holds_the_same_detections_as_files(
    simulated: SimulatedNetwork, survey: Path, tmp_path: Path
) -> None:
    live = record(survey, tmp_path / "live", list(sent(simulated)))

    def keys(folder: Path) -> list[tuple[object, ...]]:
        messages = open_network(folder).messages()
        return sorted((m.camera, m.panel, stop, m.pixels.tobytes()) for m, stop in messages if isinstance(m, Detection))

    assert keys(live) == keys(survey)


def test_a_robot_is_led_through_the_building_by_what_its_cameras_saw(simulated: SimulatedNetwork) -> None:
    names = tuple(camera.name for camera in simulated.scene.cameras)
    nodes = tuple(Node((float(pose[0]), float(pose[1]))) for pose in simulated.cameras)
    ways = tuple(Edge((i, (i + 1) % len(names))) for i in range(len(names)))
    itinerary = Itinerary(Graph(nodes, ways, 0, names), names)
    stops = {message.stop: message for message in sent(simulated) if isinstance(message, Stop)}
    seen = [message for message in sent(simulated) if isinstance(message, Detections)]
    legs = []
    for number, stop in stops.items():
        here = [message for message in seen if message.stop == number]
        goes_on = replace(stop, standing=False, sequence=len(stops) + number)
        legs += [leg for message in (*here, goes_on) if (leg := itinerary.take(message))]
    assert [leg.to for leg in legs[:-1]] == [leg.start for leg in legs[1:]], "the drive is that of the ring"
    assert {leg.start for leg in legs} == set(names)
    assert legs[-1].sigma < legs[len(names) - 1].sigma


def test_images_without_a_stop_are_left_out_and_counted(
    simulated: SimulatedNetwork, survey: Path, tmp_path: Path
) -> None:
    messages = [m for m in sent(simulated) if not isinstance(m, Stop)]
    recording = open_network(record(survey, tmp_path / "live", messages))
    assert not any(isinstance(m, Detection) for m, _ in recording.messages())
    assert recording.notes.skipped["images of an unknown stop"] > 10


def test_the_commands_meet_record_and_end(survey: Path, tmp_path: Path) -> None:
    setup = tmp_path / "setup"
    shutil.copytree(survey, setup, ignore=shutil.ignore_patterns("odometry.*", "detections.*"))
    images = tmp_path / "images"
    images.mkdir()
    for i in range(12):
        Image.fromarray(np.full((48, 64), 20 * i, np.uint8)).save(images / f"{i}.png")
    (images / "5.png").write_bytes(b"no image")
    rows = [f"ODOM,{0.05 * i:.2f},/odom,odom,base_link,{min(i, 20) / 20},0,0" for i in range(200)]
    (tmp_path / "drive.csv").write_text("\n".join(["# groma csv 1", *rows]) + "\n")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"127.0.0.1:{free.getsockname()[1]}"
    groma = [str(Path(sys.executable).with_name("groma")), "cameras"]
    meet = ["--endpoint", endpoint]
    words = [*groma, "node", str(images), "--camera", "eye", "--target", str(setup / "target.toml"), *meet]
    node = subprocess.Popen([*words, "--journal", str(tmp_path / "journal")], stderr=subprocess.PIPE, text=True)
    try:
        words = [*groma, "survey", str(setup), "--drive", str(tmp_path / "drive.csv"), "-o", str(tmp_path / "out")]
        words += ["--recording", str(tmp_path / "received")]
        surveyed = subprocess.run([*words, *meet], capture_output=True, text=True, timeout=120)
    finally:
        node.terminate()
        _, told = node.communicate(timeout=30)
    assert surveyed.returncode == 1, "nothing was seen, so there is no map"
    assert "eye is there" in surveyed.stderr
    assert "no camera saw" in surveyed.stderr.splitlines()[-1]
    assert node.returncode == 0, told
    assert "waiting for a survey" in told
    recorded = [m for m in read_messages(tmp_path / "received" / LIVE) if isinstance(m, Detections)]
    assert [m.stop for m in recorded if m.survey] == [0, 0, 0]
    assert (tmp_path / "journal" / "eye").is_dir()
    before = (tmp_path / "received" / LIVE).read_bytes()
    again = subprocess.run([*words, *meet], capture_output=True, text=True, timeout=120)
    assert again.returncode == 2
    assert "a recording is never replaced" in again.stderr
    assert (tmp_path / "received" / LIVE).read_bytes() == before


def test_the_command_leads_from_camera_to_camera(simulated: SimulatedNetwork, survey: Path, tmp_path: Path) -> None:
    setup, first = tmp_path / "setup", simulated.scene.cameras[0].name
    shutil.copytree(survey, setup, ignore=shutil.ignore_patterns("odometry.*", "detections.*"))
    places = {camera.name: (8.0 * i, 0.0) for i, camera in enumerate(simulated.scene.cameras)}
    ways = [[a, b] for a, b in pairwise(places)]
    nodes = "".join(f"  {name}: [{x}, {y}]\n" for name, (x, y) in places.items())
    edges = "".join(f"  - [{a}, {b}]\n" for a, b in ways)
    (tmp_path / "floor.yaml").write_text(f"nodes:\n{nodes}edges:\n{edges}")
    rows = [f"ODOM,{0.05 * i:.2f},/odom,odom,base_link,{min(i, 5) / 20},0,0" for i in range(70)]
    (tmp_path / "drive.csv").write_text("\n".join(["# groma csv 1", *rows]) + "\n")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"127.0.0.1:{free.getsockname()[1]}"
    words = [str(Path(sys.executable).with_name("groma")), "cameras", "survey", str(setup), "--endpoint", endpoint]
    words += ["--drive", str(tmp_path / "drive.csv"), "--building", str(tmp_path / "floor.yaml")]
    seen = next(message for message in sent(simulated) if isinstance(message, Detections) and message.sender == first)
    with connect(endpoint) as session:

        def look(sample: zenoh.Sample) -> None:
            stop = decode(sample.payload.to_bytes(), str(sample.key_expr))
            if isinstance(stop, Stop) and stop.standing:
                session.put(data_key(SITE, first), encode(replace(seen, survey=stop.boot, stop=stop.stop)))

        with session.declare_subscriber(data_key(SITE, ROBOT), look):
            surveyed = subprocess.run(
                [*words, "-o", str(tmp_path / "out")], capture_output=True, text=True, timeout=120, cwd=tmp_path
            )
    assert list(tmp_path.glob(f"recordings/*/{LIVE}"))
    assert f"{first}: next drive 8 m to {ways[0][1]}, by (8.0, 0.0)" in surveyed.stderr


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["node", "IMAGES", "--camera", "a/b", "--target", "TARGET"], "letters"),
        (["node", "IMAGES", "--camera", "survey", "--target", "TARGET"], "the survey's"),
        (["node", "nowhere", "--camera", "eye", "--target", "TARGET"], "nowhere"),
        (["node", "IMAGES", "--camera", "eye", "--target", "nowhere.toml"], "nowhere.toml"),
        (["node", "IMAGES", "--camera", "eye", "--target", "TARGET", "--rate", "-1"], "--rate"),
        (["node", "IMAGES", "--camera", "eye", "--target", "TARGET", "--key", "k.pem"], "all three"),
        (["node", "IMAGES", "--camera", "eye", "--target", "TARGET", "--endpoint", "0.0.0.0:1"], "TLS"),
        (["survey", "nowhere"], "no such folder"),
        (["survey", "SETUP", "--building", "nowhere.yaml"], "nowhere.yaml"),
        (["survey", "SETUP", "--building", "BUILDING"], "bears the name of a camera"),
    ],
)
def test_a_mistake_is_reported_in_one_line(
    words: list[str], complaint: str, survey: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "images").mkdir()
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "images" / "0.png")
    (tmp_path / "hand.yaml").write_text("nodes:\n  dock: [0, 0]\n  hall: [8, 0]\nedges:\n  - [dock, hall]\n")
    places = {"IMAGES": str(tmp_path / "images"), "TARGET": str(survey / "target.toml")}
    places |= {"SETUP": str(survey), "BUILDING": str(tmp_path / "hand.yaml")}
    journal = ["--journal", str(tmp_path / "journal")] if words[0] == "node" else []
    assert run(["cameras", *(places.get(word, word) for word in words), *journal]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert complaint in line
