"""Values that a scenario leaves to chance: distributions, and draws from them.

The kinds are those of the stochastic distributions of ASAM OpenSCENARIO 1.2 (`UniformDistribution`,
`NormalDistribution` with its optional range, `DistributionSet`). A distribution is a value: frozen,
hashable, equal to one of the same kind and numbers. It has no random numbers of its own.
"""

import abc
import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final, Generic, TypeVar

import numpy as np
from typing_extensions import override

Value = TypeVar("Value")

LEAST_MASS: Final = 0.01
"""Share of a normal distribution that must lie within its bounds; the less, the more is redrawn."""


class Distribution(abc.ABC):
    """What a number may be; as the type of a parameter, in the parameter's unit."""

    __slots__ = ()

    @property
    @abc.abstractmethod
    def lowest(self) -> float:
        """The inclusive lower bound of all draws; minus infinity if there is none."""

    @property
    @abc.abstractmethod
    def highest(self) -> float:
        """The inclusive upper bound of all draws; infinity if there is none."""

    @property
    def is_constant(self) -> bool:
        """Whether all draws are the same number."""
        return self.lowest == self.highest

    @abc.abstractmethod
    def draw(self, rng: np.random.Generator) -> float:
        """One value, in the unit of the distribution."""


@dataclass(frozen=True, slots=True)
class Constant(Distribution):
    """Always the same value; nothing is drawn from the random stream.

    Attributes:
        value: in the unit of the distribution.
    """

    value: float

    @property
    @override
    def lowest(self) -> float:
        return self.value

    @property
    @override
    def highest(self) -> float:
        return self.value

    @override
    def draw(self, rng: np.random.Generator) -> float:
        del rng
        return self.value


class _Bounded(Distribution):
    """A distribution between `low` and `high`, which its kinds declare, in its unit."""

    __slots__ = ()

    low: float
    high: float

    @property
    @override
    def lowest(self) -> float:
        return self.low

    @property
    @override
    def highest(self) -> float:
        return self.high


@dataclass(frozen=True, slots=True)
class Uniform(_Bounded):
    """Every value between two bounds is equally likely.

    A draw is `middle + half_width * rng.uniform(-1.0, 1.0)` with `middle = (low + high) / 2` and
    `half_width = (high - low) / 2`: one number of the stream, whatever the bounds are, so that a
    wider interval stretches the draws of a narrower one about their middle. What rounding moves
    past a bound is put onto it.

    Attributes:
        low, high: inclusive bounds, in the unit of the distribution.

    Raises:
        ValueError: `low` is above `high`.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError(
                f"the lower bound {self.low:g} is above the upper bound {self.high:g}; "
                "write the smaller one first"
            )

    @override
    def draw(self, rng: np.random.Generator) -> float:
        middle, half_width = (self.low + self.high) / 2, (self.high - self.low) / 2
        drawn = middle + half_width * float(rng.uniform(-1.0, 1.0))
        return min(max(drawn, self.low), self.high)


@dataclass(frozen=True, slots=True)
class Normal(_Bounded):
    """Normally distributed; with bounds, a draw beyond them is repeated until one is between.

    So the density between the bounds keeps its form, and a draw takes one number of the stream or
    more. (OpenSCENARIO says the variance; this is its root.)

    Attributes:
        mean: of the distribution without bounds, in the unit of the distribution.
        deviation: standard deviation of the distribution without bounds, positive, in that unit.
        low, high: inclusive bounds, in that unit; infinite if there are none.

    Raises:
        ValueError: `deviation` is not positive, or of the distribution without bounds less than
            `LEAST_MASS` is between them.
    """

    mean: float
    deviation: float
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if not self.deviation > 0:
            raise ValueError(f"the deviation {self.deviation:g} is not positive")
        if self.low > self.high:
            raise ValueError(f"the bound `low`, {self.low:g}, is above `high`, {self.high:g}")
        whole = NormalDist(self.mean, self.deviation)
        mass = whole.cdf(self.high) - whole.cdf(self.low)
        if mass < LEAST_MASS:
            raise ValueError(
                f"of the normal distribution about {self.mean:g} only {mass:.2g} is between "
                f"{self.low:g} and {self.high:g}, too little to draw from (at least {LEAST_MASS})"
            )

    @override
    def draw(self, rng: np.random.Generator) -> float:
        while True:
            drawn = float(rng.normal(self.mean, self.deviation))
            if self.low <= drawn <= self.high:
                return drawn


@dataclass(frozen=True, slots=True)
class _Weighted(Generic[Value]):
    """Values of which one is drawn.

    Attributes:
        values: at least one; numbers are in the unit of the distribution.
        weights: positive, one for each value; how likely they are in proportion. None: all are
            equally likely.

    Raises:
        ValueError: there is no value, or the weights do not fit.
    """

    values: tuple[Value, ...]
    weights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.values:
            raise ValueError("there is nothing to choose from; write at least one value")
        if self.weights and len(self.weights) != len(self.values):
            raise ValueError(
                f"{len(self.weights)} weights do not fit {len(self.values)} values; "
                "write one for each"
            )
        if not all(weight > 0 for weight in self.weights):
            raise ValueError("weights must be positive; leave out what shall never be chosen")

    def _drawn(self, rng: np.random.Generator) -> Value:
        """One of the values, by inversion of the cumulative weights."""
        count = len(self.values)
        limits = np.cumsum(self.weights if self.weights else np.ones(count))
        found = int(np.searchsorted(limits, rng.random() * limits[-1], side="right"))
        return self.values[min(found, count - 1)]  # the product may round up to the last limit


@dataclass(frozen=True, slots=True)
class Choice(_Weighted[float], Distribution):
    """One of the given values; a draw takes one number of the stream."""

    @property
    @override
    def lowest(self) -> float:
        return min(self.values)

    @property
    @override
    def highest(self) -> float:
        return max(self.values)

    @override
    def draw(self, rng: np.random.Generator) -> float:
        return self._drawn(rng)


@dataclass(frozen=True, slots=True)
class DistributedText(_Weighted[str]):
    """One of the given texts; of a single one nothing is drawn."""

    @property
    def is_constant(self) -> bool:
        """Whether all draws are the same text."""
        return len(set(self.values)) == 1

    def draw(self, rng: np.random.Generator) -> str:
        """One of the texts."""
        return self.values[0] if len(self.values) == 1 else self._drawn(rng)
