"""Fixtures for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

_SHARED = Path(__file__).parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """Recordings and tools of others that lie beside the project; tests that use them carry the marker `shared`."""
    if not _SHARED.is_dir():
        pytest.skip("no recordings beside the project (../shared)")
    return _SHARED
