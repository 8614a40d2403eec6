"""A pose graph read from a g2o file and optimised: no command of groma does, the library does."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.io.g2o import read_g2o


def run(arguments: list[str]) -> int:
    """Read the file that is named, optimise the graph, take its marginals; return an exit code as the commands do."""
    try:
        graph = read_g2o(Path(arguments[0]))
        index = {vertex: k for k, vertex in enumerate(graph.ids.tolist())}
        pairs = np.array([[index[a], index[b]] for a, b in graph.pairs.tolist()], dtype=np.int64).reshape(-1, 2)
        measured = (pairs, graph.measurements, graph.information)
        nodes, _, weights, *_ = _core.pose_graph_optimize(graph.poses, *measured, np.ones(len(pairs), dtype=bool))
        _core.pose_graph_marginals(nodes, *measured, weights)
    except (UserError, ValueError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    except EstimationError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0
