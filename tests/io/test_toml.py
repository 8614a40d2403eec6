from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groma.io.toml import to_toml

TEXT = st.text(st.characters(codec="utf-8"))
PLAIN = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | TEXT
VALUES = st.recursive(PLAIN | st.lists(PLAIN), lambda inner: st.dictionaries(TEXT, inner), max_leaves=20)


@given(st.dictionaries(TEXT, VALUES))
def test_the_standard_library_reads_it_back(values: dict[str, object]) -> None:
    assert tomllib.loads(to_toml(values)) == values


def test_text() -> None:
    values = {"b": np.float64(0.1), "a": {"n": np.int64(3), "inner": {"on": True}, "unset": None}, "c": (1, 2)}
    assert to_toml(values) == "b = 0.1\nc = [1, 2]\n\n[a]\nn = 3\n# unset is unset\n\n[a.inner]\non = true\n"


def test_refuses_other_types() -> None:
    with pytest.raises(TypeError, match="complex"):
        to_toml({"z": 1j})
