"""What integrates an ordinary differential equation up to the next event."""

import abc
from dataclasses import dataclass

from orchestrator.signal import Array


class Problem(abc.ABC):
    """A differential equation x' = f(t, x) with functions whose signs mark events.

    Vectors are addresses of float64 elements. Every function returns whether it can be evaluated
    there; if not, a solver may try elsewhere.

    Attributes:
        size: number of states, at least 1.
        indicators: number of functions whose signs mark events.
        has_jacobian: whether `jacobian` can be called.
    """

    size: int
    indicators: int
    has_jacobian: bool

    @abc.abstractmethod
    def rates(self, t: float, states: int, rates: int) -> bool:
        """Evaluate f at `t` [s] into the vector `rates`."""

    @abc.abstractmethod
    def signs(self, t: float, states: int, values: int) -> bool:
        """Evaluate the functions whose signs mark events into the vector `values`."""

    @abc.abstractmethod
    def jacobian(self, t: float, states: int, columns: Array) -> bool:
        """Evaluate df/dx, of shape (size, size), `columns[k]` the derivatives by state `k`."""


@dataclass(frozen=True, slots=True)
class Reached:
    """Where a step of a solver ended.

    Attributes:
        t: the time [s].
        is_event: a sign has changed there.
    """

    t: float
    is_event: bool


class Solver(abc.ABC):
    """Integrates a problem, in steps of its own choice."""

    @property
    @abc.abstractmethod
    def states(self) -> Array:
        """Those reached, float64, shape (size,), contiguous; the memory stays where it is."""

    @abc.abstractmethod
    def restart(self, t: float, states: Array, nominals: Array) -> None:
        """Begin anew, without any memory of what was before.

        Args:
            t: the time [s].
            states: float64, shape (size,).
            nominals: of the states, positive, float64, shape (size,).
        """

    @abc.abstractmethod
    def advance(self, stop: float) -> Reached:
        """Make one step that ends at `stop` [s] at the latest, and evaluates nothing behind it.

        Raises:
            FmuError: the FMU failed, or the solver cannot meet its tolerance.
        """

    @abc.abstractmethod
    def free(self) -> None:
        """Free what it holds, once."""
