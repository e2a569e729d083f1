"""Errors of the poses that vehicles believe to have."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.localisation.gauss_markov import Transition, transition
from fmus.physics.random_normals import STRIDE, mixed_bits, standard_normals
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

_OF: Final = 3  # x, y and heading
_MEMORY: Final = 20
"""After so many correlation times what is left of an error is below the resolution of a double."""
_WORD: Final = 2**64 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """How good the localisation of vehicles is.

    Attributes:
        position: standard deviation of each coordinate of the position [m].
        heading: standard deviation of the heading [rad].
        correlation: after which the autocorrelation of errors is 1 / e [ns]; 0: different points of
            time are independent.
    """

    position: float
    heading: float
    correlation: Duration

    @property
    def is_perfect(self) -> bool:
        """Whether nothing is off."""
        return not self.position and not self.heading


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Offsets:
    """What vehicles believe of their poses, less what is so.

    Attributes:
        vehicle: their numbers, ascending, int64, (vehicle,).
        position: [m], (vehicle, 2).
        heading: [rad], (vehicle,).
    """

    vehicle: Array
    position: Array
    heading: Array

    def rows(self, vehicles: Array) -> Array:
        """The rows of these vehicles; all are among them.

        Args:
            vehicles: their numbers, int64, shape (n,).

        Returns:
            Indices, shape (n,).
        """
        return np.asarray(np.searchsorted(self.vehicle, vehicles))


class PoseErrors:
    """Errors of each vehicle's pose: stationary Gauss-Markov processes of second order.

    They are as smooth as what navigation filters put out (`fmus.localisation.gauss_markov`). What
    drives them is a function of the seed, the vehicle and the time, so that the errors of a vehicle
    do not depend on the traffic around it. A vehicle that was not there for 20 correlation times is
    a stranger.

    Args:
        accuracy: how large the errors are, and how long they last.
        seed: selects the random numbers, any whole number.
    """

    def __init__(self, accuracy: Accuracy, seed: int) -> None:
        self._accuracy = accuracy
        self._seed = seed
        self._vehicles = np.empty(0, np.int64)  # ascending
        self._times = np.empty(0, np.int64)
        self._states = np.empty((0, 2, _OF))  # value and slope of each error, of variance 1

    @property
    def remembered(self) -> frozenset[int]:
        """The vehicles whose errors go on when they are asked for again."""
        return frozenset(self._vehicles.tolist())

    def at(self, vehicles: Array, now: Time) -> Offsets:
        """The errors of these vehicles at `now`.

        Args:
            vehicles: their numbers, int64, shape (vehicle,), in any order.
            now: not before the last time that was asked for [ns].
        """
        numbers = np.unique(vehicles)
        errors = self._advanced(numbers, now)[:, 0]
        given = self._accuracy
        return Offsets(
            vehicle=numbers,
            position=given.position * errors[:, :2],
            heading=given.heading * errors[:, 2],
        )

    def _advanced(self, vehicles: Array, now: Time) -> Array:
        """The states of `vehicles`, ascending, at `now` [ns], shape (vehicle, 2, 3)."""
        states = standard_normals(self._bits(vehicles, now))
        if not self._accuracy.correlation:
            return states
        age = self._ages(vehicles, now)
        for span in np.unique(age[age >= 0]).tolist():
            rows = np.flatnonzero(age == span)
            last = self._states[np.searchsorted(self._vehicles, vehicles[rows])]
            states[rows] = _moved(self._transition(span), last, states[rows])
        self._keep(vehicles, states, now)
        return states

    def _ages(self, vehicles: Array, now: Time) -> Array:
        """How long before `now` each was there last [ns], int64; -1 for strangers."""
        age = np.full(len(vehicles), -1, np.int64)
        _, known, asked = np.intersect1d(self._vehicles, vehicles, return_indices=True)
        since = now - self._times[known]
        age[asked] = np.where(since <= _MEMORY * self._accuracy.correlation, since, -1)
        return age

    def _transition(self, span: Duration) -> Transition:
        return transition(span, self._accuracy.correlation)

    def _keep(self, vehicles: Array, states: Array, now: Time) -> None:
        """Remember these states, and of the others those that are not forgotten."""
        lasts = now - self._times <= _MEMORY * self._accuracy.correlation
        lasts &= ~np.isin(self._vehicles, vehicles)
        numbers = np.concatenate([self._vehicles[lasts], vehicles])
        times = np.concatenate([self._times[lasts], np.full(len(vehicles), now)])
        order = np.argsort(numbers)
        self._vehicles, self._times = numbers[order], times[order]
        self._states = np.concatenate([self._states[lasts], states])[order]

    def _bits(self, vehicles: Array, now: Time) -> Array:
        """Random bits for each state of each vehicle at `now` [ns], uint64, (vehicle, 2, 3)."""
        key = mixed_bits(np.array([(self._seed + STRIDE) & _WORD], np.uint64))
        key = mixed_bits((key ^ np.uint64(now & _WORD)) + np.uint64(STRIDE))
        keys = mixed_bits((key ^ vehicles.astype(np.uint64)) + np.uint64(STRIDE))
        # down from the key, where the counter of the rays of a lidar runs up
        counter = [(k + 1) * STRIDE & _WORD for k in range(2 * _OF)]
        bits = mixed_bits(keys[:, None] - np.array(counter, np.uint64))
        return bits.reshape(-1, 2, _OF)


def _moved(step: Transition, last: Array, fresh: Array) -> Array:
    """States one step later, shape (vehicle, 2, 3); `fresh` are standard normal numbers.

    Sum by sum: a matrix product may round otherwise on another machine.
    """
    (a, b), (c, d) = step.keeps
    (p, _), (q, r) = step.adds
    value = a * last[:, 0] + b * last[:, 1] + p * fresh[:, 0]
    slope = c * last[:, 0] + d * last[:, 1] + (q * fresh[:, 0] + r * fresh[:, 1])
    return np.stack([value, slope], axis=1)
