from __future__ import annotations

from pathlib import Path

import pytest

from groma.errors import UserError
from groma.io.camera_protocol import Stop, encode
from groma.link import journal as module
from groma.link.journal import Journal


def message(sequence: int, boot: str = "b0") -> Stop:
    return Stop(sender="cam", boot=boot, sequence=sequence, stop=sequence, stamp=0.5, standing=True)


def filled(directory: Path, boot: str, count: int) -> Journal:
    journal = Journal(directory, boot)
    for i in range(count):
        journal.append(message(i, boot))
    return journal


def test_messages_of_this_boot_and_those_before_can_be_read_again(tmp_path: Path) -> None:
    filled(tmp_path, "b0", 3).close()
    journal = filled(tmp_path, "b1", 2)
    assert journal.counts == {"b0": 3, "b1": 2}
    assert journal.read("b0", 1, 2) == [encode(message(1)), encode(message(2))]
    assert journal.read("b1", 0, 99) == [encode(message(0, "b1")), encode(message(1, "b1"))]
    assert journal.read("b1", 2, 99) == []
    assert journal.read("b9", 0, 1) == []
    journal.close()


def test_a_line_cut_by_a_crash_is_no_message(tmp_path: Path) -> None:
    filled(tmp_path, "b0", 3).close()
    path = tmp_path / "b0.jsonl"
    path.write_bytes(path.read_bytes()[:-7])
    journal = Journal(tmp_path, "b1")
    assert journal.counts == {"b0": 2, "b1": 0}
    assert len(journal.read("b0", 0, 9)) == 2
    journal.close()


def test_old_boots_are_dropped_when_there_is_too_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for boot in ("b0", "b1", "b2"):
        filled(tmp_path, boot, 10).close()
    monkeypatch.setattr(module, "SIZE_MAX", (tmp_path / "b0.jsonl").stat().st_size * 5 // 2)
    journal = Journal(tmp_path, "b3")
    assert set(journal.counts) == {"b1", "b2", "b3"}
    journal.close()


def test_two_starts_never_share_a_file(tmp_path: Path) -> None:
    filled(tmp_path, "b0", 1).close()
    with pytest.raises(UserError, match="journal"):
        Journal(tmp_path, "b0")


def test_a_place_that_is_no_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="choose another"):
        Journal(tmp_path / "file", "b0")
