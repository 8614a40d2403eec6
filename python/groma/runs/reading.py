"""A recording whose reading ends, as if it ended there, when a run is interrupted."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from groma._core import Token
from groma.io.notes import Notes
from groma.io.recording import Recording
from groma.io.streams import Stream
from groma.nouns.messages import Message


@dataclass(frozen=True, slots=True)
class Watched:
    """A recording, and what ends its reading."""

    recording: Recording
    token: Token

    @property
    def path(self) -> Path:
        """Where it lies."""
        return self.recording.path

    @property
    def format(self) -> str:
        """What it is, in words."""
        return self.recording.format

    @property
    def notes(self) -> Notes:
        """What the last pass skipped, and what was assumed."""
        return self.recording.notes

    @property
    def streams(self) -> tuple[Stream, ...]:
        """What it carries that groma reads."""
        return self.recording.streams

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages until there are no more or the token is cancelled."""
        for message in self.recording.messages(streams):
            if self.token.cancelled:
                return
            yield message
