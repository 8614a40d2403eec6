"""Fixtures for all tests."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

_SHARED = Path(__file__).parents[2] / "shared"

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell gives its background jobs a SIGINT that is ignored, and so would be that of every command under test.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Recordings and tools of others that lie beside the project; tests that use them carry the marker `shared`."""
    if not _SHARED.is_dir():
        pytest.skip("no recordings beside the project (../shared)")
    return _SHARED
