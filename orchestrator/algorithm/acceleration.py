"""How the next trial of an iteration is made of those before."""

import abc
import math

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array

_DEPENDENT = 1e-10
"""A column of which less than this is new says nothing."""


class Acceleration(abc.ABC):
    """Chooses what the next repetition sees, for one solution; it may remember.

    A repetition maps what is seen, x, to what is computed, g(x); a solution has g(x) = x.
    """

    @abc.abstractmethod
    def following(self, seen: Array, computed: Array, scale: Array) -> Array:
        """What to see next, shape (element,).

        Args:
            seen: x, shape (element,), of the same length at each call.
            computed: g(x), shape (element,).
            scale: what a change of each element is to be compared with, shape (element,), positive.
        """


class Relaxation(Acceleration):
    """Sees a share of each change.

    Args:
        share: of the change; 1 is plain fixed-point iteration.
    """

    def __init__(self, share: float) -> None:
        self._share = share

    @override
    def following(self, seen: Array, computed: Array, scale: Array) -> Array:
        return (
            computed if self._share == 1.0 else np.asarray(seen + self._share * (computed - seen))
        )


class QuasiNewton(Acceleration):
    """Interface quasi-Newton, inverse and by least squares (IQN-ILS).

    Differences of residuals r = g(x) - x of the repetitions so far, as columns of V, and those of
    g(x), as columns of W, tell how residuals depend on x: the next x is g(x) + W c, where c
    minimises |V c + r| (Degroote, Bathe, Vierendeels, "Performance of a new partitioned procedure
    versus a monolithic procedure in fluid-structure interaction", Comput. Struct. 87, 2009,
    equations 24 to 28). Of a linear loop of n unknowns it finds the solution after n + 2
    repetitions, whatever the loop gain.

    Sums are exact before they are rounded, so that the result is the same on every machine.

    Args:
        share: of the change that the second repetition sees.
    """

    def __init__(self, share: float = 1.0) -> None:
        self._first = Relaxation(share)
        self._computed: list[Array] = []
        self._residuals: list[Array] = []

    @override
    def following(self, seen: Array, computed: Array, scale: Array) -> Array:
        residual = computed - seen
        if self._computed and self._computed[-1].shape != computed.shape:
            self._computed, self._residuals = [], []
        self._computed.append(computed)
        self._residuals.append(residual)
        # the newest differences first: older ones that add nothing are left out
        pairs = zip(self._residuals[-2::-1], self._computed[-2::-1], strict=True)
        basis: list[tuple[Array, Array]] = []  # orthonormal, and what it does to g(x)
        for old_residual, old_computed in pairs:
            column = np.asarray((old_residual - residual) / scale)
            effect = np.asarray(old_computed - computed)
            length = _norm(column)
            for _ in range(2):
                for direction, its_effect in basis:
                    share = _dot(direction, column)
                    column = np.asarray(column - share * direction)
                    effect = np.asarray(effect - share * its_effect)
            rest = _norm(column)
            if rest > _DEPENDENT * length and rest > 0.0:
                basis.append((np.asarray(column / rest), np.asarray(effect / rest)))
        if not basis:
            return self._first.following(seen, computed, scale)
        found = computed
        for direction, effect in basis:
            found = np.asarray(found - _dot(direction, residual / scale) * effect)
        return found


def _dot(a: Array, b: Array) -> float:
    return math.fsum((a * b).tolist())


def _norm(a: Array) -> float:
    return math.sqrt(_dot(a, a))
