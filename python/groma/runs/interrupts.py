"""Ctrl-C and requests to terminate: the first ends the work with what it has, the second the process at once.

While a run lives, signals do not raise: no write is cut in two. The C handler of the interpreter puts the number of
a signal into a socket, and a thread takes it from there; so a signal is heard although the main thread is busy in the
core. Signals that were ignored when the process began (``nohup``) stay ignored.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from groma._core import Token

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_SHOW_CURSOR = "\x1b[?25h"


@contextmanager
def cancelling(token: Token) -> Iterator[None]:
    """Cancel a token at the first signal, end the process at the second; only in the main thread."""
    heard = [s for s in _SIGNALS if signal.getsignal(s) is not signal.SIG_IGN]
    if threading.current_thread() is not threading.main_thread() or not heard:
        yield
        return
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    thread = threading.Thread(target=_watch, args=(ours, token), daemon=True)
    before_fd = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    before = {number: signal.signal(number, _heard) for number in heard}
    thread.start()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(before_fd)
        theirs.close()
        thread.join()
        ours.close()


def _watch(ours: socket.socket, token: Token) -> None:
    while data := ours.recv(1):
        if data[0] in _SIGNALS:
            if token.cancelled:
                _end(data[0])
            token.cancel()


def _end(number: int) -> None:
    """End the process without another word: what it was writing lies beside its place, and is swept by the next run."""
    if sys.stderr.isatty():
        sys.stderr.write(_SHOW_CURSOR)
        sys.stderr.flush()
    os._exit(128 + number)


def _heard(number: int, frame: FrameType | None) -> None:
    """Do nothing: the watching thread has it."""
