"""The examples and the core's Python tests hold on older processors too: no expectation depends on the last bits.

Results are the same bytes on one machine; across machines they agree within the tolerances of the tests. `make
test-portable` runs the whole quick suite this way.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
SCRIPT = TESTS.parent / "scripts" / "older_processor.py"
CORE = ("test_docstrings.py", "test_features.py", "test_localization.py", "test_pose_graph.py", "test_calibration.py")
CANNOT = 77


@pytest.mark.parametrize("hidden", ["avx512", "avx2"])
def test_an_older_processor_passes_as_well(hidden: str) -> None:
    script = [sys.executable, str(SCRIPT), hidden]
    pytests = [sys.executable, "-m", "pytest", "-p", "no:faulthandler", "-p", "no:cacheprovider", "-m", "not slow"]
    done = subprocess.run(
        [*script, *pytests, *(str(TESTS / name) for name in CORE)],
        cwd=TESTS.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode == CANNOT:
        pytest.skip("this machine cannot hide instructions from a program")
    assert done.returncode == 0, done.stdout[-2000:]


def test_what_is_hidden_is_not_seen() -> None:
    seen = "from numpy._core._multiarray_umath import __cpu_features__ as f; print(f['AVX512F'], f['AVX2'], f['FMA3'])"
    for hidden, expected in (("avx512", "False"), ("avx2", "False False False")):
        command = [sys.executable, str(SCRIPT), hidden, sys.executable, "-c", seen]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == CANNOT:
            pytest.skip("this machine cannot hide instructions from a program")
        assert done.stdout.strip().startswith(expected)
