"""The sqlite3 container of ROS 2 bags: tables topics, messages and, from ROS 2 Iron on, message_definitions."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

from groma.errors import UserError
from groma.io.containers import Channel, CutError, Raw

MAGIC = b"SQLite format 3\0"


class Db3:
    """One ``.db3`` file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def channels(self) -> tuple[list[Channel], bool]:
        """Return the channels; see :class:`groma.io.containers.Container`."""
        with closing(self._open()) as database:
            topics = self._topics(database)
            try:
                counts = dict(database.execute("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id"))
            except sqlite3.Error:
                return topics, False
        return [replace(topic, count=counts.get(topic.key, 0)) for topic in topics], True

    def messages(self, skip: Collection[int]) -> Iterator[Raw]:
        """Yield raw messages; see :class:`groma.io.containers.Container`."""
        with closing(self._open()) as database:
            known = {topic.key: topic for topic in self._topics(database)}
            wanted = [key for key in known if key not in set(skip)]
            marks = ",".join("?" * len(wanted))
            query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id"  # noqa: S608
            try:
                for key, time, data in database.execute(query, wanted):
                    yield known[key], int(time), bytes(data)
            except (sqlite3.Error, TypeError, ValueError) as error:
                raise CutError(f"the database is damaged ({error})") from error

    def _open(self) -> sqlite3.Connection:
        try:
            database = sqlite3.connect(f"file:{quote(str(self.path.absolute()))}?mode=ro&immutable=1", uri=True)
            database.text_factory = lambda text: text.decode(errors="replace")
            # else sqlite refuses a file that is shorter than its header says
            database.execute("PRAGMA writable_schema=ON")
        except sqlite3.Error as error:
            raise UserError(f"{self.path}: cannot be opened as a database ({error})") from error
        return database

    def _topics(self, database: sqlite3.Connection) -> list[Channel]:
        try:
            rows = database.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id").fetchall()
        except sqlite3.Error as error:
            raise UserError(f"{self.path}: a database, but no readable ROS 2 bag ({error})") from error
        definitions = _definitions(database)
        return [
            Channel(int(key), str(topic), str(kind), str(encoding), *definitions.get(kind, ("", "msg")))
            for key, topic, kind, encoding in rows
        ]


def _definitions(database: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    try:
        query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
        rows = database.execute(query).fetchall()
    except sqlite3.Error:  # older bags have no such table
        return {}
    return {kind: (text, "idl" if encoding == "ros2idl" else "msg") for kind, text, encoding in rows}
