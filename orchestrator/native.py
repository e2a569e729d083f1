"""What a component tells about itself so that it can be stepped without Python.

An FMU is a table of functions; whoever knows their addresses can call them in compiled code, many
times between two communication points that Python has to see. See `orchestrator.plan`.
"""

import abc
import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from orchestrator.signal import Array, Signal, Signals
from orchestrator.timebase import Duration, Time


class NativeKind(enum.IntEnum):
    """How the elements of a variable lie in the memory of an FMU; the numbers of the engine."""

    PLAIN = 0
    """Whole numbers, as in the signal."""

    FLOAT32 = 1
    FLOAT64 = 2

    BOOLEAN8 = 3
    """FMI 3.0: a byte."""

    BOOLEAN32 = 4
    """FMI 2.0: an int."""

    BINARY = 5
    """FMI 3.0: a pointer and a size."""

    TEXT = 6
    """A pointer to a text that ends with zero."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NativeVariable:
    """An input or output of a native unit.

    Attributes:
        type: the FMI type, which names the functions that set and get it.
        kind: how its elements lie in memory.
        reference: its value reference.
        shape: over the whole run.
    """

    type: str
    kind: NativeKind
    reference: int
    shape: tuple[int, ...]

    @property
    def count(self) -> int:
        """How many elements it has."""
        return math.prod(self.shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class NativeUnit:
    """The functions of one running instance, and its variables; addresses are whole numbers.

    A component in another process has no functions that could be called, but a link.

    Attributes:
        version: of FMI: 2 or 3, which says how functions are called; 0 where there is a link.
        instance: the first argument of all functions.
        step: of `fmi2DoStep` or `fmi3DoStep`.
        keeps_state: no stored state will be asked back.
        flags: FMI 3.0: where a step says that an event, the end, an early return came.
        last_time: FMI 3.0: where a step says how far it came.
        setters: by FMI type.
        getters: by FMI type.
        variables: inputs and outputs, by name of the connector.
        owner: takes over where the engine stops.
        link: to another process, where the component is in one. Each input is of a type of its own.
    """

    version: int
    instance: int
    step: int
    keeps_state: bool
    flags: Sequence[int]
    last_time: int
    setters: Mapping[str, int]
    getters: Mapping[str, int]
    variables: Mapping[str, NativeVariable]
    owner: "NativeOwner"
    link: "NativeLink | None" = None


@dataclass(frozen=True, slots=True)
class NativePlace:
    """Where a signal lies.

    Attributes:
        offset: from the start of the memory [byte].
        size: [byte].
        dtype, shape: of the array.
    """

    offset: int
    size: int
    dtype: "np.dtype[Any]"
    shape: tuple[int, ...]


class NativeOwner(abc.ABC):
    """The component behind a native unit: it explains failures and goes on after a stretch."""

    @abc.abstractmethod
    def count_calls(self, address: int | None) -> None:
        """Messages of different steps are told apart by the number (uint64) at `address`.

        Args:
            address: of the number; `None`: the engine is gone.
        """

    @abc.abstractmethod
    def is_written(self, name: str, value: Signal) -> bool:
        """Whether the input `name` was last set to this very object."""

    @abc.abstractmethod
    def adopt(self, driven: Sequence[str], written: Mapping[str, Signal], read: Signals) -> None:
        """Go on after a stretch.

        Args:
            driven: the inputs that the engine has set.
            written: those of them that are up to date, and the objects they are set to.
            read: the outputs.
        """

    @abc.abstractmethod
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        """Setting these inputs returned `status`, which is not OK.

        Raises:
            Exception: what the same call had raised in `step`; nothing after a mere warning.
        """

    @abc.abstractmethod
    def complete_step(self, status: int, t: Time, h: Duration) -> None:
        """The step from `t` returned `status`, neither OK nor a mere warning: make the rest of it.

        Args:
            status: -1: OK or a warning, but something was said beside it.
            t: where it began [ns].
            h: its length [ns].

        Raises:
            Exception: see `setting_failed`.
        """

    @abc.abstractmethod
    def getting_failed(self, type_: str, status: int) -> None:
        """Getting the outputs of one type returned `status`, which is not OK.

        Raises:
            Exception: see `setting_failed`.
        """


class NativeLink(NativeOwner):
    """The way to a component in another process, and the memory that both see.

    Its `complete_step` lets the dialogue with the component go on from what was said and heard.

    Attributes:
        address: of what the engine knows of it (`link.h`).
        inputs: the address where each input is to be written, by name.
    """

    address: int
    inputs: Mapping[str, int]

    @abc.abstractmethod
    def lay_out(self, outputs: "Mapping[str, NativePlace]", size: int) -> Sequence[Array]:
        """Have the outputs written as they lie in the memory of the engine.

        Args:
            outputs: where each is, by name.
            size: of all [byte].

        Returns:
            Two blocks, in which they are in turn; read-only, shape (size,).
        """

    @abc.abstractmethod
    def enter(self, *, is_begun: bool) -> None:
        """The engine takes over.

        Args:
            is_begun: whether a step is under way that was begun in Python.
        """

    @abc.abstractmethod
    def leave(self) -> tuple[Time, Duration] | None:
        """Python takes over, also the waiting for a step that is under way.

        Returns:
            Where that starts, and its length [ns]; `None` if there is none.
        """
