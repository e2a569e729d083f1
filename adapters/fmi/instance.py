"""What the adapter needs of one FMU instance, whatever its FMI version."""

import abc
from collections.abc import Collection, Mapping, Sequence

from adapters.fmi.errors import failure
from adapters.fmi.messages import STATUS_NAMES, MessageLog
from orchestrator.native import NativeOwner, NativeUnit
from orchestrator.signal import Connector, Signal

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

    def refuse(self, function: str, status: int, remark: str = "") -> None:
        """Raise the error for `status`, with what the FMU logged."""
        self.is_dead = self.is_dead or status == FATAL
        self.has_failed = self.has_failed or status in {DISCARD, ERROR}
        name = STATUS_NAMES[status] if status < len(STATUS_NAMES) else str(status)
        raise failure(function, name + remark, self._log.recent)


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
        """Set parameters or inputs; arrays have the lengths that `configure` said."""

    @abc.abstractmethod
    def write_text(self, values: Mapping[str, str]) -> None:
        """Set parameters that are strings."""

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
    def exit_initialisation(self) -> None:
        """Leave initialisation mode."""

    @abc.abstractmethod
    def step(self, t: float, h: float) -> None:
        """Advance from `t` to `t + h` [s]."""

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
    def judge_step(self, status: int, t: float, h: float) -> None:
        """Judge the step from `t` to `t + h` [s]; -1: what it said beside an OK.

        Raises:
            FmuError: it failed, was discarded, or asks to end the simulation.
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

    @abc.abstractmethod
    def save(self) -> int:
        """Store the FMU state; an address for `restore` and `forget`."""

    @abc.abstractmethod
    def restore(self, state: int, lengths: Mapping[str, int]) -> None:
        """Return to a stored state, in which structural parameters have the values `lengths`."""

    @abc.abstractmethod
    def forget(self, state: int) -> None:
        """Free a stored state; harmless after `free`."""

    @abc.abstractmethod
    def free(self) -> None:
        """Free the states, the instance, the library and the temporary folder, once."""
