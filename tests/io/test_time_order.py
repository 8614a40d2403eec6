from __future__ import annotations

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from groma.io.time_order import LATENESS, LEAP, MOST, Sorter


def ordered(stamps: list[float]) -> tuple[list[float], Counter[str]]:
    skipped: Counter[str] = Counter()
    sorter: Sorter[float] = Sorter(skipped)
    out = [item for stamp in stamps for item in sorter.push(stamp, 0, stamp, "scans")]
    return [*out, *sorter.drain()], skipped


def test_slightly_late_messages_are_sorted_in() -> None:
    assert ordered([1.0, 2.0, 1.5, 3.0, 2.9, 4.0]) == ([1.0, 1.5, 2.0, 2.9, 3.0, 4.0], Counter())


def test_a_block_that_repeats_is_dropped_and_counted() -> None:
    stamps = [*range(20), *range(5, 30)]
    out, skipped = ordered([float(s) for s in stamps])
    assert out == sorted(out)
    assert len(out) + sum(skipped.values()) == len(stamps)
    assert list(skipped) == ["scans more than 2 s late"]
    assert out[-1] == 29.0


def test_one_wrong_stamp_ahead_does_not_cost_the_rest() -> None:
    out, skipped = ordered([1.0, 2.0, 1e9, 3.0, 4.0])
    assert out == [1.0, 2.0, 3.0, 4.0]
    assert sum(skipped.values()) == 1


def test_a_pause_is_no_wrong_stamp() -> None:
    stamps = [1.0, 2.0, 2.0 + 10 * LEAP, 3.0 + 10 * LEAP, 4.0 + 30 * LEAP]
    assert ordered(stamps) == (stamps, Counter())


def test_scans_far_apart() -> None:
    stamps = [2.0 * LEAP * k for k in range(10)]
    assert ordered(stamps) == (stamps, Counter())


def test_equal_times_go_by_rank_then_by_arrival() -> None:
    sorter: Sorter[str] = Sorter(Counter())
    for rank, item in ((1, "scan"), (0, "odometry"), (1, "second scan")):
        assert not list(sorter.push(5.0, rank, item, ""))
    assert list(sorter.drain()) == ["odometry", "scan", "second scan"]


def test_what_waits_is_bounded() -> None:
    sorter: Sorter[int] = Sorter(Counter())
    out = sum(1 for k in range(3 * MOST) for _ in sorter.push(k * 1e-6, 0, k, ""))
    assert out == 2 * MOST


@given(st.lists(st.floats(0, 1e6)))
def test_nothing_is_lost_without_being_counted(stamps: list[float]) -> None:
    out, skipped = ordered(stamps)
    assert len(out) + sum(skipped.values()) == len(stamps)


@given(st.lists(st.floats(0, 0.9 * LATENESS), max_size=200))
def test_bounded_disorder_is_sorted_whole(lateness: list[float]) -> None:
    stamps = [0.1 * k - late for k, late in enumerate(lateness)]
    out, skipped = ordered(stamps)
    assert out == sorted(stamps)
    assert not skipped
