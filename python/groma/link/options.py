"""Where the camera network meets, and with which keys: the options that its commands share."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from groma.errors import UserError
from groma.io.camera_protocol import SITE
from groma.link.session import ENDPOINT, Keys


@dataclass(frozen=True, slots=True)
class Link:
    """Where to meet."""

    endpoint: str = ENDPOINT
    """HOST:PORT at which the survey listens; outside the loopback TLS is needed."""
    site: str = SITE
    """Name of the network: two that share an endpoint do not hear each other."""
    authority: Path | None = None
    """Certificate (PEM) of the authority that signed those of both sides."""
    certificate: Path | None = None
    """Own certificate (PEM)."""
    key: Path | None = None
    """Its private key (PEM)."""

    @property
    def keys(self) -> Keys | None:
        """The files for TLS.

        Raises
        ------
        UserError
            When some are given and some are not.
        """
        if self.authority and self.certificate and self.key:
            return Keys(self.authority, self.certificate, self.key)
        if self.authority or self.certificate or self.key:
            raise UserError("TLS needs all three: --authority, --certificate and --key")
        return None


@contextmanager
def end_on_signal() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C or a request to terminate sets while the block lasts."""
    end = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        end.set()

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield end
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
