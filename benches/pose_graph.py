"""Times groma's pose graph beside GTSAM's on g2o files and on a made drive of the size of M3500.

Run as ``.venv/bin/python benches/pose_graph.py FILE.g2o.gz ...``; needs gtsam (``pip install --group oracle``).
Each figure is the best of several runs from the start of the file, single threaded in groma, default options on both
sides; GTSAM's optimiser is the fastest of its three that ends at the cost which groma found (0.1 %).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import gtsam
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from groma import _core
from oracle import gtsam_graphs
from pose_graphs import Graph, city, dead_reckoned, read_g2o

RUNS = 7
write = sys.stdout.write


def best(work: Callable[[], object]) -> tuple[float, object]:
    """Shortest of several runs [ms], and the last result."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times), result


def gtsam_best(graph: Graph, cost: float) -> float:
    """Time [ms] of GTSAM's fastest optimiser that reaches `cost`; infinite when none does."""
    factors, start = gtsam_graphs.between_factors(graph), gtsam_graphs.values(graph.nodes)
    times = [np.inf]
    for kind in ("GaussNewton", "LevenbergMarquardt", "Dogleg"):
        for solver in ("MULTIFRONTAL_CHOLESKY", "MULTIFRONTAL_QR"):
            parameters = getattr(gtsam, f"{kind}Params")()
            parameters.setLinearSolverType(solver)
            optimizer = getattr(gtsam, f"{kind}Optimizer")
            try:
                spent, found = best(lambda o=optimizer, p=parameters: o(factors, start, p).optimize())  # type: ignore[misc]
            except RuntimeError:  # an indeterminate system
                continue
            if abs(2.0 * factors.error(found) - cost) < 1e-3 * cost:
                times.append(spent)
    return min(times)


def report(name: str, graph: Graph) -> None:
    """Print one line of the table."""
    trusted = np.zeros(len(graph.pairs), dtype=bool)
    spent, solution = best(lambda: _core.pose_graph_optimize(graph.nodes, *graph.edges, trusted))
    nodes, chi_squares, weights = solution[:3]  # type: ignore[index]
    marginals, _ = best(lambda: _core.pose_graph_marginals(nodes, *graph.edges, weights))
    other = gtsam_best(graph, chi_squares.sum())
    write(
        f"{name:28} {len(nodes):6} {len(trusted):6} {spent:9.1f} {other:9.1f} {spent / other:7.2f} {marginals:9.1f}\n"
    )


write(f"{'graph':28} {'nodes':>6} {'edges':>6} {'groma ms':>9} {'gtsam ms':>9} {'ratio':>7} {'cov. ms':>9}\n")
for argument in sys.argv[1:]:
    report(Path(argument).name, read_g2o(Path(argument)))
report("made, as M3500", dead_reckoned(city(3500, 1954, np.random.default_rng(1), (0.05, 0.05, 0.02))))
