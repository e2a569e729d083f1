"""How long the next step is, by how wrong the last ones were."""

from collections.abc import Sequence
from typing import Any, Final

from orchestrator.timebase import Duration

_SAFETY: Final = 0.9
_SHORTEST, _LONGEST = 0.2, 5.0
"""The next step is at most this much shorter, or longer, than the last one."""
_INTEGRAL, _PROPORTIONAL = 0.7, 0.4
_EXACT: Final = 1e-10


class StepControl:
    """A PI controller of step sizes.

    The next step is h 0.9 e_n^(-0.7/q) e_(n-1)^(0.4/q), with the errors e of the last two steps in
    tolerances (Gustafsson, "Control theoretic techniques for stepsize selection in explicit
    Runge-Kutta methods", ACM TOMS 17(4), 1991; Hairer and Wanner, "Solving ordinary differential
    equations II", section IV.2); behind a step that was taken back h 0.9 e^(-1/q).

    Args:
        longest: the longest step [ns].
        smallest: a step of this length, or what is left, counts whatever its error [ns]. So does
            the first one, which is as short: there is nothing yet to extrapolate from.
        order: q; the error grows with this power of the step.

    Attributes:
        accepted: steps that count.
        rejected: steps that were taken back.
        forced: of the accepted ones, those with a larger error, without the first.
        shortest: of the accepted ones [ns]; 0 before the first.
    """

    def __init__(self, longest: Duration, smallest: Duration, order: int) -> None:
        self._longest, self._smallest, self._order = longest, smallest, order
        self._proposal = float(smallest)
        self._last_error = 1.0
        self._is_retry = False
        self.accepted = self.rejected = self.forced = 0
        self.shortest: Duration = 0

    def memory(self) -> list[Any]:
        """All that changes, as `orchestrator.packing` takes it."""
        counts = [self.accepted, self.rejected, self.forced, self.shortest]
        return [self._proposal, self._last_error, self._is_retry, *counts]

    def recall(self, memory: Sequence[Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self._proposal, self._last_error, self._is_retry, *counts = memory
        self.accepted, self.rejected, self.forced, self.shortest = counts

    def next(self, rest: Duration) -> Duration:
        """The length of the next step [ns], where `rest` is left; what remains is no splinter."""
        h = max(int(self._proposal), self._smallest)
        if h >= rest:
            return rest
        return h if 2 * h <= rest else (rest + 1) // 2

    def may_reject(self, h: Duration) -> bool:
        """Whether a step of this length is taken back if its error is too large."""
        return h > self._smallest

    def judge(self, h: Duration, error: float) -> bool:
        """Whether a step counts; the next ones follow from it.

        Args:
            h: its length [ns].
            error: in tolerances, not negative, perhaps infinite.
        """
        is_accepted = error <= 1.0 or not self.may_reject(h)
        found = min(max(error, _EXACT), 1.0 / _EXACT)
        if is_accepted:
            factor = found ** (-_INTEGRAL / self._order) * self._last_error ** (
                _PROPORTIONAL / self._order
            )
            most = h if self._is_retry else _LONGEST * max(h, self._proposal)
            self._last_error = min(found, 1.0)
            self._count(h, error)
        else:
            factor, most = found ** (-1.0 / self._order), h * _SAFETY
            self.rejected += 1
        self._proposal = min(max(_SAFETY * factor, _SHORTEST) * h, most, self._longest)
        self._is_retry = not is_accepted
        return is_accepted

    def _count(self, h: Duration, error: float) -> None:
        self.accepted += 1
        self.forced += error > 1.0 and self.accepted > 1
        self.shortest = h if self.accepted == 1 else min(self.shortest, h)
