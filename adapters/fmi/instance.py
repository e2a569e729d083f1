"""What the adapter needs of one FMU instance, whatever its FMI version."""

import abc
from collections.abc import Collection, Mapping, Sequence
from typing import NoReturn

from adapters.fmi.errors import FmuError, failure
from adapters.fmi.messages import STATUS_NAMES, MessageLog
from adapters.fmi.outcome import StepOutcome
from orchestrator.native import NativeOwner, NativeUnit
from orchestrator.signal import Array, Connector, Signal

OK, WARNING, DISCARD, ERROR, FATAL = range(5)


class Guard:
    """Judges the status of every FMI call.

    Attributes:
        is_dead: the FMU returned Fatal; nothing may be called any more, in this process, not
            even to free it (FMI 3.0.2, section 2.2.3; FMI 2.0.4, section 2.1.3).
    """

    def __init__(self, log: MessageLog) -> None:
        self._log = log
        self.is_dead = False
        self.has_failed = False

    def check(self, function: str, status: int) -> None:
        """Accept OK and Warning.

        Raises:
            FmuError: any other status.
        """
        if status <= WARNING:
            self._log.recent.clear()
            return
        self.refuse(function, status)

    def refuse(self, function: str, status: int, remark: str = "", hint: str = "") -> NoReturn:
        """Raise the error for `status`, with what the FMU logged between `remark` and `hint`."""
        self.is_dead = self.is_dead or status == FATAL
        self.has_failed = self.has_failed or status in {DISCARD, ERROR}
        name = STATUS_NAMES[status] if status < len(STATUS_NAMES) else str(status)
        raise failure(function, name + remark, self._log, hint)


class FmuInstance(abc.ABC):
    """One instance of an FMU, instantiated on creation.

    Order of calls: `configure`, `write` (parameters), `enter_initialisation`, `write` (inputs),
    `exit_initialisation`, then any of `configure`, `write`, `step`, `read`; last `free`.
    """

    @abc.abstractmethod
    def configure(self, lengths: Mapping[str, int]) -> None:
        """Give structural parameters new values; arrays along them lose theirs."""

    @abc.abstractmethod
    def write(self, values: Mapping[str, Signal]) -> None:
        """Set parameters or inputs; arrays have the lengths that `configure` said.

        Args:
            values: by name. Those of an array of texts or Binaries come together.
        """

    @property
    @abc.abstractmethod
    def uses_events(self) -> bool:
        """Whether its events are handled with it: FMI 3.0, `eventModeUsed`."""

    @abc.abstractmethod
    def begin_step(self) -> None:
        """Hear that a communication step begins."""

    @abc.abstractmethod
    def write_jumps(self, values: Mapping[str, Signal], t: float) -> bool:
        """Set inputs some of which jump at `t` [s]; as an event where events are handled.

        Input clocks among them are triggered, whatever their value.

        Returns:
            Whether the FMU asks to end the simulation.
        """

    @abc.abstractmethod
    def write_text(self, values: Mapping[str, Sequence[str]]) -> None:
        """Set parameters of the type String, by name, to all of their elements."""

    @abc.abstractmethod
    def enter_initialisation(
        self, t: float, *, stop: float | None, tolerance: float | None
    ) -> None:
        """Enter initialisation mode at time `t` [s].

        Args:
            t: the first communication point [s].
            stop: the last one, if it is known [s].
            tolerance: relative, for the solver of the FMU; `None`: its own.
        """

    @abc.abstractmethod
    def exit_initialisation(self, t: float) -> bool:
        """Leave initialisation mode at `t` [s], and handle the events there.

        Returns:
            Whether the FMU asks to end the simulation.
        """

    @abc.abstractmethod
    def step(self, t: float, h: float) -> StepOutcome:
        """Ask for a step from `t` to `t + h` [s], and say what came of it.

        Raises:
            FmuError: it failed.
        """

    @abc.abstractmethod
    def native(self, connectors: Mapping[str, Connector], owner: NativeOwner) -> NativeUnit | None:
        """How compiled code can call this instance.

        Args:
            connectors: of the component.
            owner: the component.
        """

    @abc.abstractmethod
    def count_calls(self, address: int | None) -> None:
        """See `NativeOwner.count_calls`."""

    @abc.abstractmethod
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        """Judge the status of a call that set these inputs.

        Raises:
            FmuError: it is neither OK nor Warning.
        """

    @abc.abstractmethod
    def outcome(self, status: int, t: float) -> StepOutcome:
        """What came of the step from `t` [s] that was asked for last, elsewhere.

        Args:
            status: that it returned; -1: it was OK or a warning, and more was said beside it.
            t: where the step began [s].

        Raises:
            FmuError: it failed.
        """

    @abc.abstractmethod
    def discarded(self, reached: float, hint: str) -> NoReturn:
        """Raise what is wrong with a discarded step.

        Args:
            reached: the last successful time [s].
            hint: what to say behind it.
        """

    @abc.abstractmethod
    def getting_failed(self, type_: str, status: int) -> None:
        """Judge the status of a call that got the outputs of one type.

        Raises:
            FmuError: it is neither OK nor Warning.
        """

    @abc.abstractmethod
    def select(self, names: Collection[str] | None) -> None:
        """Let `read` get these outputs only; with `None` all of them, as at first."""

    @abc.abstractmethod
    def read(self) -> dict[str, Signal]:
        """The selected outputs; arrays are new and read-only."""

    def tell_rates(self, rates: Mapping[str, Sequence[float]], t: float) -> None:
        """Set derivatives of inputs with respect to time; of FMUs whose `input_degree` is above 0.

        Args:
            rates: by input, the first derivative first [unit/s, unit/s^2, ...].
            t: where the next step begins [s].
        """
        raise FmuError(f"the FMU takes no derivatives of inputs, such as {', '.join(rates)}")

    def told_rates(self) -> dict[str, Signal]:
        """The first derivatives of outputs with respect to time [unit/s], where it tells them."""
        return {}

    @property
    @abc.abstractmethod
    def lengths(self) -> Mapping[str, int]:
        """The values of the structural parameters."""

    @abc.abstractmethod
    def directional(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        """The derivatives of `unknowns` along a change of `knowns`.

        Args:
            unknowns: outputs.
            knowns: inputs.
            seed: their changes one after the other, float64, shape (elements of knowns,).

        Returns:
            Float64, shape (elements of unknowns,).
        """

    @abc.abstractmethod
    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        """The gradient by `knowns` of `unknowns` that are weighted.

        Args:
            unknowns: outputs.
            knowns: inputs.
            seed: weights one after the other, float64, shape (elements of unknowns,).

        Returns:
            Float64, shape (elements of knowns,).
        """

    @abc.abstractmethod
    def save(self) -> int:
        """Store the FMU state; an address for `restore` and `forget`."""

    @abc.abstractmethod
    def restore(self, state: int, lengths: Mapping[str, int] | None) -> None:
        """Return to a stored state.

        Args:
            state: which one.
            lengths: the values that structural parameters have in it; `None`: as now.
        """

    @abc.abstractmethod
    def serialize(self, state: int) -> bytes:
        """A stored state as bytes."""

    @abc.abstractmethod
    def deserialize(self, content: bytes) -> int:
        """A stored state made of bytes; an address for `restore` and `forget`.

        Raises:
            FmuError: the FMU does not take them.
        """

    @abc.abstractmethod
    def forget(self, state: int) -> None:
        """Free a stored state; harmless after `free`."""

    @abc.abstractmethod
    def free(self) -> None:
        """Free the states, the instance, the library and the temporary folder, once."""
