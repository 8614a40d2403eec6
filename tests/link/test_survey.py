from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

import link_network
from groma.io.camera_protocol import Detections, Numbered, Odometry, Picture, Stop, ask_key, data_key, encode, in_order
from groma.io.link_recording import Recorder, read_messages
from groma.link.journal import Journal
from groma.link.node import new_boot
from groma.link.session import connect, listen
from groma.link.survey import Survey
from link_network import Lossy, made_node


@pytest.fixture
def endpoint() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{free.getsockname()[1]}"


@contextmanager
def surveying(endpoint: str, path: Path) -> Iterator[tuple[Survey, list[Numbered]]]:
    """Run a survey for the time of the block; afterwards the recording is closed."""
    session, recorder, end = listen(endpoint), Recorder(path), threading.Event()
    fresh: list[Numbered] = []
    survey = Survey(session, "site", new_boot(), recorder, fresh.append)
    thread = threading.Thread(target=survey.run, args=(end,))
    thread.start()
    try:
        yield survey, fresh
    finally:
        end.set()
        thread.join()
        recorder.close()
        session.close()


def await_all(survey: Survey) -> None:
    deadline = time.monotonic() + 20
    while any(peer.tally.missing for peer in survey.peers().values() if peer.alive):
        assert time.monotonic() < deadline
        time.sleep(0.1)


@contextmanager
def nodes(endpoint: str, folder: Path, cameras: list[str], rate: float) -> Iterator[None]:
    end = threading.Event()
    made = [made_node(endpoint, camera, folder, rate, seed) for seed, camera in enumerate(cameras)]
    threads = [threading.Thread(target=node.run, args=(end,)) for node in made]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        end.set()
        for thread in threads:
            thread.join()
        for node in made:
            node.journal.close()
            node.session.close()


def drive(endpoint: str, seconds: float, seed: int = 99) -> None:
    """Drive a metre, then stand, at 20 poses a second, over a network that loses; every second one metre."""
    session = connect(endpoint)
    lossy = Lossy(session, seed)
    boot = new_boot()
    for i in range(round(20 * seconds)):
        whole, rest = divmod(i, 40)
        x = whole + min(rest, 20) / 20
        pose = Odometry(sender="robot", boot=boot, sequence=i, stamp=0.05 * i, x=x, y=0.0, theta=0.0)
        lossy.put(data_key("site", "robot"), encode(pose))
        time.sleep(0.05)
    time.sleep(1.2)
    session.close()


def kept(folder: Path, camera: str) -> list[bytes]:
    """Return all messages in the journal of a node that has ended."""
    journal = Journal(folder / camera, "zz")
    found = [data for boot, count in journal.counts.items() for data in journal.read(boot, 0, count - 1)]
    journal.close()
    (folder / camera / "zz.jsonl").unlink()
    return found


def received(messages: list[Numbered], camera: str) -> list[bytes]:
    return [encode(message) for message in in_order(messages) if message.sender == camera]


def test_all_that_the_cameras_saw_arrives_though_messages_are_lost_repeated_and_late(
    endpoint: str, tmp_path: Path
) -> None:
    cameras = ["left", "right"]
    with (
        surveying(endpoint, tmp_path / "recording.mcap") as (survey, fresh),
        nodes(endpoint, tmp_path, cameras, rate=20.0),
    ):
        drive(endpoint, 3.0)
        assert {name for name, peer in survey.peers().items() if peer.alive} == set(cameras)
        await_all(survey)
    counts = [len(received(fresh, camera)) for camera in cameras]
    for camera, count in zip(cameras, counts, strict=True):
        assert count > 40
        assert received(fresh, camera) == kept(tmp_path, camera)[:count]
    assert any(isinstance(m, Stop) and m.standing for m in fresh)
    assert {m.stop for m in fresh if isinstance(m, Detections) and m.survey} == {0}
    recorded = [m for m in read_messages(tmp_path / "recording.mcap") if isinstance(m, Numbered)]
    assert in_order(recorded) == in_order(fresh)


def test_a_recording_that_lacks_its_end_is_read_up_to_there(endpoint: str, tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    with surveying(endpoint, path):
        drive(endpoint, 0.5)
        cut = path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(cut[:-5])
    whole = list(read_messages(path))
    part = list(read_messages(tmp_path / "cut.mcap"))
    assert 0 < len(part) < len(whole)
    assert part == whole[: len(part)]


def test_an_image_travels_only_on_request(endpoint: str, tmp_path: Path) -> None:
    with surveying(endpoint, tmp_path / "recording.mcap") as (survey, fresh), nodes(endpoint, tmp_path, ["eye"], 20.0):
        deadline = time.monotonic() + 10
        while len(received(fresh, "eye")) < 3:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        seen = next(m for m in in_order(fresh) if isinstance(m, Detections))
        replies = [
            list(survey.session.get(ask_key("site", "eye"), payload=encode(Picture(boot=seen.boot, frame=frame))))
            for frame in (seen.frame, 10**6)
        ]
    ((image,), (refused,)) = replies
    assert image.ok is not None
    assert image.ok.payload.to_bytes().startswith(b"\x89PNG")
    assert refused.err is not None
    assert "not kept" in refused.err.payload.to_string()


def end(processes: Iterable[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.slow
def test_eight_cameras_one_of_which_is_killed_every_five_seconds(endpoint: str, tmp_path: Path) -> None:
    cameras = [f"cam{i}" for i in range(8)]

    def start(camera: str, seed: int) -> subprocess.Popen[bytes]:
        words = [sys.executable, link_network.__file__, endpoint, camera, str(tmp_path), "10", str(seed)]
        return subprocess.Popen(words)

    with surveying(endpoint, tmp_path / "recording.mcap") as (survey, fresh), ExitStack() as stack:
        running = {camera: start(camera, seed) for seed, camera in enumerate(cameras)}
        stack.callback(lambda: end(running.values()))
        for turn in range(6):
            drive(endpoint, 5.0, seed=turn)
            victim = cameras[turn]
            running[victim].kill()
            running[victim].wait()
            running[victim] = start(victim, 100 + turn)
        time.sleep(4)
        told = {name: peer.health.counts for name, peer in survey.peers().items() if peer.health}
        await_all(survey)
        end(running.values())
        assert survey.refused == 0
    assert {camera: len(boots) for camera, boots in told.items()} == {c: 2 if c < "cam6" else 1 for c in cameras}
    for camera in cameras:
        sent, got = kept(tmp_path, camera), set(received(fresh, camera))
        assert got <= set(sent)
        for boot, count in told[camera].items():
            assert count > 0
            mine = [data for data in sent if f'"boot":"{boot}"'.encode() in data]
            assert set(mine[:count]) <= got
    recorded = [m for m in read_messages(tmp_path / "recording.mcap") if isinstance(m, Numbered)]
    assert in_order(recorded) == in_order(fresh)
