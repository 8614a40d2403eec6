"""One run: what it leaves, what it refuses, what it tells, and how it ends."""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

import groma
from groma.errors import EstimationError, ToldError, UserError
from groma.nouns.findings import Finding
from groma.runs import exchange as exchange_module
from groma.runs.record import fingerprint, printable, shown_command
from groma.runs.run import Run

ALWAYS = {"metrics.json", "run.toml", "report.html"}
CUT = Finding("recording-cut", "a.bag: cut after message 7", (1.0, 2.0), (3.0, 4.0), {"count": (7, "1")})
SKIPPED = Finding("records-skipped", "skipped: 3 NEFF")


def leave(output: Path | None, *findings: Finding, text: str = "1", name: str = "walls.csv", kind: str = "map") -> Run:
    """Leave the folder of a run."""
    with Run(kind, kind, output, settings={kind: {"size": 2.0}}, command="groma test") as run:
        run.write_text(name, text)
        run.extend(findings)
        run.finish({"walls": 4, "length": float("nan")}, "Four walls.")
    return run


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def record(folder: Path) -> dict[str, object]:
    return tomllib.loads((folder / "run.toml").read_text())


def metrics(folder: Path) -> dict[str, object]:
    content = json.loads((folder / "metrics.json").read_text())
    assert isinstance(content, dict)
    return content


def findings(folder: Path) -> list[dict[str, object]]:
    found = metrics(folder)["findings"]
    assert isinstance(found, list)
    return found


def test_it_leaves_a_whole_folder_and_nothing_beside_it(tmp_path: Path) -> None:
    leave(tmp_path / "out")
    assert {path.name for path in tmp_path.iterdir()} == {"out"}
    assert set(files(tmp_path / "out")) == {"walls.csv", *ALWAYS}
    assert metrics(tmp_path / "out") == {
        "kind": "map",
        "verdict": "consistent",
        "findings": [],
        "length": None,
        "walls": 4,
    }


def test_the_record_lists_every_file_and_what_made_them(tmp_path: Path) -> None:
    source = tmp_path / "day.log"
    source.write_text("FLASER\n")
    with Run("map", "map", tmp_path / "out", settings={"map": {"seed": 3}}, command="groma map day.log") as run:
        run.inputs["input"] = source
        run.write_text("deep/er.csv", "")
        run.finish({})
    made = record(tmp_path / "out")
    assert made["files"] == sorted(["deep/er.csv", *ALWAYS])
    assert made["input"] == {"name": "day.log", "bytes": 7, "sha256": hashlib.sha256(b"FLASER\n").hexdigest()}
    assert (made["kind"], made["command"], made["settings"]) == ("map", "groma map day.log", {"map": {"seed": 3}})
    assert (made["groma"], made["numpy"]) == (groma.__version__, np.__version__)
    assert not any(part in (tmp_path / "out" / "run.toml").read_text() for part in tmp_path.parts[1:])


def test_the_same_run_leaves_the_same_bytes(tmp_path: Path) -> None:
    leave(tmp_path / "a", CUT)
    leave(tmp_path / "b", CUT)
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_the_findings_are_the_same_on_standard_error_in_the_report_and_in_the_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    leave(tmp_path / "out", SKIPPED, CUT, SKIPPED)
    told = capsys.readouterr()
    assert told.err.splitlines() == [
        f"warning: recording-cut: a.bag: cut after message 7. {CUT.remedy}",
        "info: records-skipped: skipped: 3 NEFF.",
    ]
    assert told.out.splitlines() == ["Four walls.", str(tmp_path / "out" / "report.html")]
    first, second = findings(tmp_path / "out")
    assert first == {
        "code": "recording-cut",
        "severity": "warning",
        "from_stamp": 1.0,
        "to_stamp": 2.0,
        "place": [3.0, 4.0],
        "values": {"count": {"value": 7, "unit": "1"}},
        "text": CUT.text,
        "remedy": CUT.remedy,
    }
    assert second["text"] == SKIPPED.text
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.index(CUT.text) < page.index(SKIPPED.text)
    assert CUT.remedy in page


def test_an_error_keeps_the_folder_and_is_told_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ToldError):
        leave(tmp_path / "out", Finding("map-torn", "torn near the door"))
    assert metrics(tmp_path / "out")["verdict"] == "torn"
    assert "walls.csv" in files(tmp_path / "out")
    assert capsys.readouterr().err.count("torn near the door") == 1


def test_without_an_estimate_a_folder_stays_that_has_no_file_of_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    leave(tmp_path / "out", text="of the run before")
    with pytest.raises(ToldError), Run("map", "map", tmp_path / "out", command="") as run:  # noqa: PT012
        run.note(CUT)
        run.write_text("walls.csv", "half")
        run.gather(lambda: [SKIPPED])
        raise EstimationError("no scan could be used")
    assert set(files(tmp_path / "out")) == ALWAYS
    assert metrics(tmp_path / "out")["verdict"] == "no-estimate"
    codes = [finding["code"] for finding in findings(tmp_path / "out")]
    assert codes == ["no-estimate", "recording-cut", "records-skipped"]
    assert "no scan could be used" in (tmp_path / "out" / "report.html").read_text()
    assert "error: no-estimate: no scan could be used." in capsys.readouterr().err


@pytest.mark.parametrize("error", [UserError("no"), RuntimeError("a bug"), KeyboardInterrupt()])
def test_refused_or_broken_it_leaves_nothing(
    error: BaseException, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    leave(tmp_path / "old")
    before = files(tmp_path / "old")
    capsys.readouterr()
    for output in (tmp_path / "old", tmp_path / "new" / "deep"):
        with pytest.raises(type(error)), Run("map", "map", output, command="") as run:  # noqa: PT012
            run.write_text("walls.csv", "2")
            run.note(CUT)
            raise error
    assert files(tmp_path / "old") == before
    assert {path.name for path in tmp_path.iterdir()} == {"old"}
    assert capsys.readouterr() == ("", "")


def test_a_run_that_is_not_finished_is_a_bug(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="did not finish"), Run("map", "map", tmp_path / "out", command=""):
        pass
    assert not (tmp_path / "out").exists()


def test_a_report_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def page(_: object) -> str:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), Run("map", "map", tmp_path / "out", command="") as run:
        run.finish({}, "", page)
    assert list(tmp_path.iterdir()) == []


def test_a_used_folder_is_replaced_as_a_whole(tmp_path: Path) -> None:
    leave(tmp_path / "out", name="old.csv")
    leave(tmp_path / "out", name="new.csv")
    assert set(files(tmp_path / "out")) == {"new.csv", *ALWAYS}
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


@pytest.mark.parametrize("foreign", ["notes.txt", "deep/notes.txt", ".hidden"])
def test_a_folder_with_a_foreign_file_is_refused_untouched(foreign: str, tmp_path: Path) -> None:
    leave(tmp_path / "out")
    path = tmp_path / "out" / foreign
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    before = files(tmp_path)
    with pytest.raises(UserError, match=f"{foreign} was not written by a groma run"):
        leave(tmp_path / "out")
    assert files(tmp_path) == before


def test_a_foreign_file_that_comes_during_the_run_is_safe_too(tmp_path: Path) -> None:
    leave(tmp_path / "out")
    with pytest.raises(UserError, match=r"late\.txt"), Run("map", "map", tmp_path / "out", command="") as run:  # noqa: PT012
        run.finish({})
        (tmp_path / "out" / "late.txt").write_text("mine")
    assert (tmp_path / "out" / "late.txt").read_text() == "mine"
    assert "walls.csv" in files(tmp_path / "out")


def test_a_link_into_another_folder_is_foreign_and_not_followed(tmp_path: Path) -> None:
    leave(tmp_path / "out")
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "a.txt").write_text("mine")
    (tmp_path / "out" / "link").symlink_to(tmp_path / "theirs", target_is_directory=True)
    with pytest.raises(UserError, match="link was not written"):
        leave(tmp_path / "out")
    assert (tmp_path / "theirs" / "a.txt").exists()


def test_an_empty_folder_is_taken_and_a_file_is_not(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    leave(tmp_path / "empty")
    (tmp_path / "file").write_text("")
    for output, told in ((tmp_path / "file", "is a file"), (tmp_path / "file" / "below", "cannot be made")):
        with pytest.raises(UserError, match=told):
            leave(output)


def test_the_working_folder_is_not_exchanged_under_the_feet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for output in (Path(), Path("..")):
        with pytest.raises(UserError, match="choose a folder in it"):
            leave(output)


def test_a_link_given_stays_a_link_to_the_new_folder(tmp_path: Path) -> None:
    leave(tmp_path / "out", text="1")
    (tmp_path / "link").symlink_to("out", target_is_directory=True)
    leave(tmp_path / "link", text="2")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "out" / "walls.csv").read_text() == "2"


def test_new_folders_are_never_reused_and_latest_points_to_the_newest_of_each_kind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    places = [leave(None, kind=kind)._report for kind in ("map", "map", "vehicle")]
    names = [place.parent.name for place in places if place]
    assert len(set(names)) == 3
    assert os.readlink("results/latest") == os.readlink("results/latest-vehicle") == names[2]
    assert os.readlink("results/latest-map") == names[1]
    assert {path.name for path in Path("results").iterdir()} == {*names, "latest", "latest-map", "latest-vehicle"}


def test_latest_without_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError("a required privilege is not determined by the client")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "symlink_to", refuse)
    leave(None)
    (folder,) = (path.name for path in Path("results").iterdir() if path.is_dir())
    assert Path("results/latest.txt").read_text() == Path("results/latest-map.txt").read_text() == f"{folder}\n"


def test_where_names_cannot_be_exchanged_the_place_is_a_link(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exchange_module, "exchange", lambda *_: False)
    for text in ("1", "2", "3"):
        leave(tmp_path / "out", text=text)
        assert (tmp_path / "out").is_symlink()
        assert (tmp_path / "out" / "walls.csv").read_text() == text
        assert len(list(tmp_path.iterdir())) == 2, "the link and the one folder that it represents"
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(UserError, match=r"notes\.txt"):
        leave(tmp_path / "out")


def test_a_folder_that_cannot_be_exchanged_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave(tmp_path / "out", text="1")
    monkeypatch.setattr(exchange_module, "exchange", lambda *_: False)
    with pytest.raises(UserError, match="cannot be exchanged"):
        leave(tmp_path / "out", text="2")
    assert (tmp_path / "out" / "walls.csv").read_text() == "1"
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


def test_what_a_dead_run_left_is_swept_and_what_a_living_one_has_is_not(tmp_path: Path) -> None:
    dead = tmp_path / ".gone.groma-abcdefgh"
    dead.mkdir()
    (dead / "half.csv").write_text("")
    mine = tmp_path / ".groma-notes"
    mine.mkdir()
    with Run("map", "map", tmp_path / "a", command="") as living:
        leave(tmp_path / "b")
        assert living.folder.exists()
        living.finish({})
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b", ".groma-notes"}


def test_interrupted_it_keeps_what_is_finished_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Run("map", "map", tmp_path / "out", command="") as run:
        assert list(run.until_cancelled([1, 2])) == [1, 2]
        run.token.cancel()
        assert list(run.until_cancelled([1, 2])) == []
        run.finish({}, "Four walls.")
    assert metrics(tmp_path / "out")["verdict"] == "interrupted"
    assert capsys.readouterr().out.startswith("Interrupted: ")


def test_a_signal_while_the_files_are_written_interrupts_nothing(tmp_path: Path) -> None:
    with Run("map", "map", tmp_path / "out", command="") as run:
        run.finish({}, "Four walls.")
        run.token.cancel()
    assert metrics(tmp_path / "out")["verdict"] == "consistent"


def test_an_interruption_cuts_what_may_end_early_and_refuses_what_may_not() -> None:
    run = Run("recording", "simulate", folder=False)
    assert list(run.until_cancelled([1, 2])) == list(run.whole([1, 2])) == [1, 2]
    early, whole = run.until_cancelled([1, 2]), run.whole([1, 2])
    assert next(early) == next(whole) == 1
    run.token.cancel()
    assert list(early) == []
    with pytest.raises(KeyboardInterrupt):
        next(whole)


def test_interrupted_before_there_is_a_result_it_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), Run("map", "map", tmp_path / "out", command="") as run:  # noqa: PT012
        run.token.cancel()
        raise EstimationError("no scan could be used")
    assert list(tmp_path.iterdir()) == []


def test_a_part_reports_nothing_itself_and_its_findings_are_those_of_the_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Run("evaluation", "demo", tmp_path / "out", command="") as whole:
        with Run("map", "map", whole.folder / "map", command="", within=whole) as part:
            part.note(CUT)
            part.finish({}, "Four walls.")
        whole.finish({}, "All.")
    assert [f["text"] for f in findings(tmp_path / "out")] == [f"map: {CUT.text}"]
    assert metrics(tmp_path / "out" / "map")["kind"] == "map"
    assert "map/report.html" in record(tmp_path / "out")["files"]  # type: ignore[operator]
    assert capsys.readouterr().out.splitlines() == ["All.", str(tmp_path / "out" / "report.html")]


def test_text_from_outside_cannot_steer_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    leave(tmp_path / "out", Finding("records-skipped", "\x1b[2J\ttopic\n\udc80\u202e end"))
    told = capsys.readouterr().err
    assert told == "info: records-skipped: \ufffd[2J topic \ufffd\ufffd end.\n"
    assert str(findings(tmp_path / "out")[0]["text"]) in told


def test_hard_spaces_and_greek_are_printable() -> None:
    assert printable("σ 3\N{NO-BREAK SPACE}mm") == "σ 3\N{NO-BREAK SPACE}mm"


def test_a_folder_is_told_file_by_file(tmp_path: Path) -> None:
    for name in ("metadata.yaml", "bag_0.db3"):
        (tmp_path / name).write_text(name)
    assert list(fingerprint(tmp_path)["files"]) == ["bag_0.db3", "metadata.yaml"]  # type: ignore[call-overload]


def test_the_command_is_recorded_without_places_and_threads() -> None:
    arguments = ["map", "a b.log", "-o", "out", "--threads=2", "--output=x", "--odometry", "none", "--threads", "4"]
    assert shown_command(arguments) == "groma map 'a b.log' --odometry none"
