"""Messages of a camera network and the keys they travel under: version 1 of the protocol.

Every message is one JSON object with `kind` and `version`. What goes into a map (detections, odometry, stops) is
numbered without gaps by its sender, from 0 at each start of the sender (`boot`), so that a receiver can tell losses,
repetitions and late arrivals, and ask for what it misses. Field by field: docs/reference/camera_protocol.md.

A field that is not known is passed over: later versions may add some. Another version number, a missing field, a value
out of its range or a number that is not finite is refused with one line.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from groma.errors import UserError

VERSION = 1
SITE = "site"
"""Name of the network in the keys when none is given."""

_NAME = r"^[A-Za-z0-9_-]{1,64}\Z"
Name = Annotated[str, Meta(pattern=_NAME)]
"""Name of a camera, a panel, a boot: safe in a key and as the name of a file."""
Count = Annotated[int, Meta(ge=0, le=2**53)]
Positive = Annotated[float, Meta(gt=0)]
Pixels = Annotated[int, Meta(gt=0, le=1 << 16)]


class Message(Struct, frozen=True, kw_only=True, tag_field="kind"):
    """What all messages have; `kind` is the name of the class in small letters."""

    version: Count = VERSION


class Numbered(Message, frozen=True, kw_only=True):
    """A message that goes into a map."""

    sender: Name
    """Camera or robot."""
    boot: Name
    """Drawn anew at each start of the sender; sorts by time of the start."""
    sequence: Count
    """0, 1, ... within the boot."""

    @property
    def number(self) -> tuple[str, str, int]:
        """Sender, boot, sequence: two messages with equal numbers are one."""
        return (self.sender, self.boot, self.sequence)


class Corners(Struct, frozen=True, kw_only=True):
    """Corners of one panel in one image."""

    panel: Name
    ids: tuple[Count, ...]
    """(k,) numbers of the corners on the panel."""
    u: tuple[float, ...]
    """(k,) columns [px]; the centre of the first pixel is 0."""
    v: tuple[float, ...]
    """(k,) rows [px]."""
    sigma: tuple[Positive, ...]
    """(k,) standard deviations of a coordinate [px]."""


class Detections(Numbered, frozen=True, kw_only=True, tag="detections"):
    """What one image of a camera shows; no panel at all is a message too."""

    frame: Count
    """Number of the image within the boot: names it in a request."""
    survey: Name | None = None
    """Boot of the survey that announced the stop it was taken at; None when no stop lasted."""
    stop: Count = 0
    """Number of that stop."""
    captured: float
    """Clock of the camera's host [s]."""
    clock_sigma: Positive
    """How far that clock may be off [s]."""
    width: Pixels
    height: Pixels
    panels: tuple[Corners, ...]
    rejected: Count = 0
    """Tags that were seen and left out: blurred, small, at the margin."""


class Odometry(Numbered, frozen=True, kw_only=True, tag="odometry"):
    """Pose of the robot in a frame that drifts (T_odom_base), planar."""

    stamp: float
    """Clock of the robot [s]."""
    x: float
    y: float
    theta: float


class Stop(Numbered, frozen=True, kw_only=True, tag="stop"):
    """The robot stands still, or goes on."""

    stop: Count
    stamp: float
    standing: bool
    burst: Annotated[int, Meta(ge=1, le=100)] = 1
    """Images requested of each camera."""


class Health(Message, frozen=True, kw_only=True, tag="health"):
    """Sent by a node at its start and every second: what it is, and what it could send again."""

    sender: Name
    boot: Name
    counts: dict[Name, Count]
    """For each boot that the node can send again: how many messages it has numbered."""
    source: str
    width: Count
    height: Count
    frames: Count
    """Images taken since the start."""
    failures: Count = 0
    """Images that could not be read."""
    trouble: str = ""
    """What a person should look after; empty when all is well."""


class Again(Message, frozen=True, kw_only=True, tag="again"):
    """Request: send messages again, the last one included."""

    boot: Name
    first: Count
    last: Count


class Picture(Message, frozen=True, kw_only=True, tag="picture"):
    """Request: the image that a message was made of, as a PNG."""

    boot: Name
    frame: Count


AnyMessage = Detections | Odometry | Stop | Health | Again | Picture
_decoder = msgspec.json.Decoder(AnyMessage)
_encoder = msgspec.json.Encoder()


def encode(message: Message) -> bytes:
    """Return the JSON of a message; equal messages give equal bytes."""
    return _encoder.encode(message)


def decode(data: bytes, where: str) -> AnyMessage:
    """Return a message.

    Parameters
    ----------
    data
        JSON.
    where
        Where it came from, for the one line of the error.

    Raises
    ------
    UserError
        When it is not a message of this version.

    Examples
    --------
    >>> from groma.io.camera_protocol import Stop, decode, encode
    >>> stop = Stop(sender="robot", boot="b0", sequence=0, stop=3, stamp=1.5, standing=True)
    >>> decode(encode(stop), "here") == stop
    True
    """
    try:
        message: AnyMessage = _decoder.decode(data)
    except msgspec.DecodeError as error:
        raise UserError(f"{where}: not a message of this protocol ({error})") from error
    _check(message, where)
    return message


def _check(message: AnyMessage, where: str) -> None:
    if message.version != VERSION:
        raise UserError(
            f"{where}: protocol version {message.version}, this is {VERSION}: bring both sides to one version"
        )
    if isinstance(message, Detections):
        for corners in message.panels:
            if not len(corners.ids) == len(corners.u) == len(corners.v) == len(corners.sigma):
                raise UserError(f"{where}: panel {corners.panel} has other counts of ids, u, v and sigma")


def checked_name(name: str, what: str) -> str:
    """Return a name that is safe in a key and in a path.

    Raises
    ------
    UserError
        When it is not.
    """
    if not re.match(_NAME, name):
        raise UserError(f"{what} {name!r}: use letters, digits, _ and -, 64 at most")
    return name


def key(site: str, *parts: str) -> str:
    """Return the key of a topic: `groma/1/SITE/...`; parts may be `*`."""
    return "/".join(("groma", str(VERSION), site, *parts))


def data_key(site: str, sender: str) -> str:
    """Return where a sender puts its numbered messages."""
    return key(site, "data", sender)


def health_key(site: str, sender: str) -> str:
    """Return where a node puts its health."""
    return key(site, "health", sender)


def alive_key(site: str, sender: str, boot: str) -> str:
    """Return the liveliness token of a node: it is there as long as the node is."""
    return key(site, "alive", sender, boot)


def ask_key(site: str, sender: str) -> str:
    """Return where a node takes requests."""
    return key(site, "ask", sender)


def in_order(messages: Sequence[Numbered]) -> list[Numbered]:
    """Return messages by sender, boot and sequence, each number once: the order that does not depend on arrival."""
    first: dict[tuple[str, str, int], Numbered] = {}
    for message in sorted(messages, key=lambda m: (m.number, encode(m))):
        first.setdefault(message.number, message)
    return list(first.values())
