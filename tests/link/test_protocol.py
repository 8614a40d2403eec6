from __future__ import annotations

import json

import pytest

from groma.errors import UserError
from groma.io.camera_protocol import Corners, Detections, Stop, checked_name, decode, encode, in_order


def detections(sequence: int, sender: str = "cam", boot: str = "b") -> Detections:
    corners = Corners(panel="front", ids=(3, 4), u=(1.25, 2.5), v=(0.1, 1e-9), sigma=(0.1, 0.2))
    return Detections(
        sender=sender,
        boot=boot,
        sequence=sequence,
        frame=sequence,
        captured=12.000000001,
        clock_sigma=0.01,
        width=640,
        height=480,
        panels=(corners,),
    )


def test_what_is_sent_is_what_arrives() -> None:
    assert decode(encode(detections(7)), "here") == detections(7)


def test_unknown_fields_are_passed_over_for_they_may_come_from_a_later_version() -> None:
    fields = json.loads(encode(detections(7))) | {"mood": "good"}
    assert decode(json.dumps(fields).encode(), "here") == detections(7)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"version": 2}, "version 2"),
        ({"kind": "song"}, "song"),
        ({"sequence": -1}, "sequence"),
        ({"sender": "../../etc"}, "sender"),
        ({"sender": "cam\n"}, "sender"),
        ({"captured": None}, "captured"),
        ({"width": 0}, "width"),
        ({"panels": [{"panel": "p", "ids": [1, 2], "u": [1.0], "v": [1.0], "sigma": [1.0]}]}, "counts"),
        ({"panels": [{"panel": "p", "ids": [1], "u": [1.0], "v": [1.0], "sigma": [0.0]}]}, "sigma"),
    ],
)
def test_a_message_with_a_wrong_field_is_refused_and_the_line_names_it(
    change: dict[str, object], complaint: str
) -> None:
    fields = json.loads(encode(detections(7))) | change
    with pytest.raises(UserError, match=complaint) as refused:
        decode(json.dumps(fields).encode(), "groma/1/site/data/cam")
    assert str(refused.value).startswith("groma/1/site/data/cam: ")


@pytest.mark.parametrize(
    "data", [b"", b"{", b"\xff\xfe", b"[]", encode(detections(1))[:-9], b'{"kind":"stop","stamp":NaN}', b"[" * 100_000]
)
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    with pytest.raises(UserError, match="not a message"):
        decode(data, "here")


@pytest.mark.parametrize("name", ["", "a/b", "..", "ä", "x" * 65, "a b", "*", "cam\n"])
def test_names_that_would_leave_their_place_are_refused(name: str) -> None:
    with pytest.raises(UserError, match="letters"):
        checked_name(name, "camera")


def test_order_does_not_depend_on_arrival() -> None:
    messages = [detections(i, sender, boot) for sender in "ba" for boot in "21" for i in (2, 0, 1, 1)]
    expected = [(sender, boot, i) for sender in "ab" for boot in "12" for i in range(3)]
    assert [message.number for message in in_order(messages)] == expected
    assert in_order(messages) == in_order(messages[::-1])


def test_of_two_messages_under_one_number_the_choice_does_not_depend_on_arrival() -> None:
    a = Stop(sender="robot", boot="b", sequence=0, stop=0, stamp=1.0, standing=True)
    b = Stop(sender="robot", boot="b", sequence=0, stop=0, stamp=2.0, standing=True)
    assert in_order([a, b]) == in_order([b, a])
