"""How many returns to known places are found by corners, and how many of the places found are right.

Protocol (docs/theory/loop_evaluation.md). ``recognize`` runs over all scans without odometry and without poses; then
the poses judge it:

    returns      scans that truly return to a place seen before (``revisits.py``): the denominator of all recalls
    a place      is right for a local map when its stretch holds a scan that the last scan of the map returns to
    a motion     is right when it differs from that of the reference by less than 0.5 m and 10 degrees
    recall       returns whose local map was answered rightly, over all returns
    precision    right answers over answers, one answer a local map at most

A scan is answered by the last local map that ended up to it. Curves sweep the threshold of one score over all answers.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.errors import EstimationError
from groma.evaluation.feature_scans import PosedScans
from groma.evaluation.revisits import revisits
from groma.mapping.recognition import Recognition, recognition_defaults, recognize
from groma.nouns.arrays import Array
from groma.nouns.poses import relative

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

RIGHT_M, RIGHT_RAD = 0.5, math.radians(10)
"""A motion is right within these."""
RANKS = (1, 5, 10, 30)
"""Numbers of candidates at which the recall of retrieval is told."""


@dataclass(frozen=True, slots=True)
class Answers:
    """What one step says of every local map, judged."""

    score: Array
    """(L,) higher is surer; -inf where nothing was said."""
    right: Mask
    """(L,) whether it is right; False where nothing was said."""
    scans: Indices
    """(L,) scans that return and are answered by each local map."""
    returns: int
    """Scans that return."""

    def precision_recall(self) -> tuple[Array, Array, Array]:
        """Return thresholds (T,), highest first, and precision and recall of the answers at or above each."""
        said = np.flatnonzero(np.isfinite(self.score))
        order = said[np.argsort(-self.score[said], kind="stable")]
        right, score = self.right[order], self.score[order]
        last = np.flatnonzero(np.append(np.diff(score) != 0, True)) if len(score) else np.empty(0, dtype=np.int64)
        precision = np.cumsum(right)[last] / (last + 1)
        return score[last], precision, np.cumsum(right * self.scans[order])[last] / self.returns

    def recall_without_error(self) -> float:
        """Return the highest recall that a threshold reaches at precision 1."""
        _, precision, recall = self.precision_recall()
        return float(recall[precision == 1].max(initial=0.0))


@dataclass(frozen=True, slots=True)
class LoopEvaluation:
    """The results of loop closure on one recording."""

    scans: PosedScans
    found: Recognition
    returns: Mask
    """(M,) scans used that truly return."""
    retrieved: dict[int, float]
    """Recall of the first so many candidates, over all returns."""
    retrieval: Answers
    """The first candidate, by the likeness of the signatures."""
    association: Answers
    """The motion with most pairs, by their number."""
    verification: Answers
    """The motion that was chosen, by overlap times share."""
    accepted: Answers
    """The closures accepted."""
    errors: Array
    """(A, 2) of the accepted closures [m], [rad]."""
    fate: dict[str, int]
    """Returns by what became of them."""

    @property
    def precision(self) -> float:
        """Share of the accepted closures that is right; NaN when none was accepted."""
        said = np.isfinite(self.accepted.score)
        return float(self.accepted.right.sum() / said.sum()) if said.any() else float("nan")

    @property
    def recall(self) -> float:
        """Share of the returns whose local map has an accepted closure that is right."""
        return float(self.accepted.scans[self.accepted.right].sum() / self.accepted.returns)


def evaluate_loops(scans: PosedScans) -> LoopEvaluation:
    """Evaluate loop closure on the scans of one recording.

    Parameters
    ----------
    scans
        All scans of a drive; their poses only judge.

    Raises
    ------
    EstimationError
        When no scan returns to a place seen before.
    """
    found = recognize(scans.scans)
    taken = np.flatnonzero(found.used)
    gap = float(recognition_defaults()["gap"])
    judge = _Judge(
        found, scans.poses[taken], revisits([scans.scans[k] for k in taken], scans.poses[taken], found.driven, gap)
    )
    if not judge.returns.any():
        raise EstimationError(
            f"{scans.name}: no scan returns to a place seen before, after {gap:g} m of drive at least, "
            f"so there is nothing to close: {len(taken)} scans over {found.driven.max(initial=0.0):.0f} m"
        )
    return judge.evaluation(scans)


class _Judge:
    """Answers against the ground truth."""

    def __init__(self, found: Recognition, poses: Array, truth: list[Indices]) -> None:
        self._found, self._poses, self._truth = found, poses, truth
        self.returns = np.array([len(t) > 0 for t in truth], dtype=np.bool_)
        self._answered = found.local_map[self.returns]
        self._scans = np.bincount(self._answered[self._answered >= 0], minlength=len(found.end))

    def evaluation(self, scans: PosedScans) -> LoopEvaluation:
        found = self._found
        ranks = {k: self._retrieved(k) for k in RANKS}
        chosen = {c.local_map: c for c in found.closures}
        errors = {n: self._error(c.place, n, c.transform) for n, c in chosen.items()}
        accepted = {n: 1.0 for n, c in chosen.items() if c.accepted}
        return LoopEvaluation(
            scans=scans,
            found=found,
            returns=self.returns,
            retrieved={k: float(self._scans[right].sum() / self.returns.sum()) for k, right in ranks.items()},
            retrieval=self._answers(self._likeness(), ranks[1]),
            association=self._answers(*self._associated()),
            verification=self._answers({n: c.overlap * c.share for n, c in chosen.items()}, self._right(errors)),
            accepted=self._answers(accepted, self._right(errors)),
            errors=np.array([errors[n] for n in accepted]).reshape(-1, 2),
            fate=self._fate(ranks[max(RANKS)]),
        )

    def _answers(self, scores: dict[int, float], right: Mask) -> Answers:
        score = np.full(len(self._scans), -np.inf)
        score[list(scores)] = list(scores.values())
        return Answers(score, right & np.isfinite(score), self._scans, int(self.returns.sum()))

    def _right(self, errors: dict[int, tuple[float, float]]) -> Mask:
        right = np.zeros(len(self._scans), dtype=np.bool_)
        right[[n for n, (metres, radians) in errors.items() if metres < RIGHT_M and radians < RIGHT_RAD]] = True
        return right

    def _error(self, place: int, local_map: int, transform: Array) -> tuple[float, float]:
        end = self._found.end
        off = relative(relative(self._poses[end[place]], self._poses[end[local_map]]), transform)
        return float(np.hypot(off[0], off[1])), float(abs(off[2]))

    def _retrieved(self, most: int) -> Mask:
        """Return (L,) whether a right place is among the first candidates of a local map."""
        first, end = self._found.first, self._found.end

        def has(n: int) -> bool:
            truth = self._truth[end[n]]
            places = self._found.candidates[n].place[:most]
            return any(np.any((truth >= first[p]) & (truth <= end[p])) for p in places)

        return np.array([has(n) for n in range(len(end))], dtype=np.bool_)

    def _likeness(self) -> dict[int, float]:
        return {n: -float(c.distance[0]) for n, c in enumerate(self._found.candidates) if len(c.place)}

    def _associated(self) -> tuple[dict[int, float], Mask]:
        best = {n: found[0] for n, found in enumerate(self._found.proposals) if found}
        errors = {n: self._error(p.place, n, p.transform) for n, p in best.items()}
        return {n: float(p.pairs) for n, p in best.items()}, self._right(errors)

    def _fate(self, retrieved: Mask) -> dict[str, int]:
        """Count the returns by the first step that failed them."""
        chosen = {c.local_map: c for c in self._found.closures}

        def word(n: int) -> str:
            if n < 0:
                return "before the first local map"
            closure = chosen.get(n)
            right = closure is not None and self._is_right(closure.place, n, closure.transform)
            if closure is not None and right:
                return f"refused: {closure.reason}" if closure.reason else "closed"
            if closure is not None and closure.accepted:
                return "closed wrongly"
            tried = any(self._is_right(p.place, n, p.transform) for p in self._found.proposals[n])
            if tried:
                return "another motion was chosen"
            return "no right motion among those associated" if retrieved[n] else "no right place among those retrieved"

        return dict(Counter(word(int(n)) for n in self._answered).most_common())

    def _is_right(self, place: int, local_map: int, transform: Array) -> bool:
        metres, radians = self._error(place, local_map, transform)
        return metres < RIGHT_M and radians < RIGHT_RAD
