"""Run a program as on an older processor: with instruction sets hidden from it.

    python scripts/older_processor.py avx512 COMMAND ...    no AVX-512
    python scripts/older_processor.py avx2 COMMAND ...      neither AVX-512 nor AVX2, AVX and FMA

Code that chooses by CPUID at run time (numpy, OpenBLAS, faer, pulp, Rust's own detection, glibc) takes its lower path;
nothing in groma knows of it. It takes Linux on x86-64, a processor that can let CPUID fault, and a C compiler; where
that is not given the exit code is 77 and nothing runs. Python programs must not use faulthandler (pytest:
``-p no:faulthandler``).
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

CANNOT = 77
_AVX512 = ",".join(f"-AVX512{part}" for part in ("F", "VL", "BW", "CD", "DQ", "ER", "PF", "_VNNI"))
TUNABLES = {"avx512": f"glibc.cpu.hwcaps={_AVX512}", "avx2": f"glibc.cpu.hwcaps={_AVX512},-AVX2,-AVX,-FMA,-FMA4"}
"""What glibc is told, by what is hidden."""


def library(folder: Path) -> Path | None:
    """Build the library that answers CPUID; nothing where it cannot be built."""
    compiler = shutil.which("cc")
    if compiler is None or platform.system() != "Linux" or platform.machine() != "x86_64":
        return None
    built = folder / "hide_instructions.so"
    source = Path(__file__).with_name("hide_instructions.c")
    command = [compiler, "-O1", "-shared", "-fPIC", "-o", str(built), str(source)]
    return built if subprocess.run(command, check=False).returncode == 0 else None  # noqa: S603 (our own source)


def run(hidden: str, command: Sequence[str]) -> int:
    """Run a command with instruction sets hidden; return its exit code, or CANNOT."""
    with tempfile.TemporaryDirectory() as folder:
        built = library(Path(folder))
        if built is None:
            return CANNOT
        more = {"LD_PRELOAD": str(built), "HIDE": hidden, "GLIBC_TUNABLES": TUNABLES[hidden]}
        return subprocess.run(command, env={**os.environ, **more}, check=False).returncode  # noqa: S603 (the caller's)


def main() -> None:
    """Run the command line."""
    if len(sys.argv) < 3 or sys.argv[1] not in TUNABLES:
        sys.exit(__doc__)
    code = run(sys.argv[1], sys.argv[2:])
    if code == CANNOT:
        print("older_processor: this machine cannot hide instructions", file=sys.stderr)  # noqa: T201 (a script)
    sys.exit(code)


if __name__ == "__main__":
    main()
