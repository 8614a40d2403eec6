from __future__ import annotations

from collections import Counter
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from groma.io.camera_protocol import Stop
from groma.link.collector import RECALL, REQUEST_MAX, Collector


def message(sequence: int, boot: str = "b0", sender: str = "cam") -> Stop:
    return Stop(sender=sender, boot=boot, sequence=sequence, stop=0, stamp=0.0, standing=True)


@given(st.integers(0, 2**32), st.integers(1, 60), st.integers(1, 3))
def test_whatever_is_lost_repeated_or_late_each_message_is_new_exactly_once(seed: int, count: int, boots: int) -> None:
    random = Random(seed)  # noqa: S311
    sent = [message(i, f"b{boot}") for boot in range(boots) for i in range(count)]
    arriving = [m for m in sent for _ in range(random.choice([0, 1, 1, 1, 2]))]
    random.shuffle(arriving)
    collector = Collector()
    collector.announce("cam", {"b0": 0}, "b0")
    new = Counter(m.number for m in arriving if collector.take(m))
    collector.announce("cam", {f"b{boot}": count for boot in range(boots)}, f"b{boots - 1}")
    for _ in range(50):  # every other answer is lost
        for _, again in collector.requests():
            if random.random() < 0.5:
                answers = (message(i, again.boot) for i in range(again.first, again.last + 1))
                new.update(m.number for m in answers if collector.take(m))
    assert new == Counter(m.number for m in sent)
    assert collector.tallies()["cam"].missing == 0
    assert collector.tallies()["cam"].taken == len(sent)


def test_a_loss_at_the_end_is_found_when_the_sender_tells_how_much_there_is() -> None:
    collector = Collector()
    assert collector.take(message(0))
    assert list(collector.requests()) == []
    collector.announce("cam", {"b0": 3}, "b0")
    assert [(name, again.first, again.last) for name, again in collector.requests()] == [("cam", 1, 2)]


def test_a_node_that_has_run_for_days_need_not_send_its_past() -> None:
    collector = Collector()
    collector.announce("cam", {"old": 900_000, "now": 500_000}, "now")
    asked = [(again.boot, again.first, again.last) for _, again in collector.requests()]
    assert asked == [("now", 500_000 - RECALL, 499_999)]
    assert not collector.take(message(5, "old"))


def test_a_boot_that_begins_later_counts_from_its_first_message() -> None:
    collector = Collector()
    collector.announce("cam", {"b0": 2}, "b0")
    collector.announce("cam", {"b0": 2, "b1": 250}, "b1")
    asked = [(again.boot, again.first, again.last) for _, again in collector.requests()]
    assert asked == [("b0", 0, 1), ("b1", 0, REQUEST_MAX - 1), ("b1", REQUEST_MAX, 249)]


def test_repetitions_are_counted() -> None:
    collector = Collector()
    assert [collector.take(message(i)) for i in (0, 1, 1, 0, 2)] == [True, True, False, False, True]
    tally = collector.tallies()["cam"]
    assert (tally.taken, tally.repeated, tally.missing) == (3, 2, 0)
