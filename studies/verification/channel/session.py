"""The channel FMU as the orchestrator drives it: a component with parameters, inputs, outputs."""

from collections.abc import Mapping
from types import TracebackType
from typing import Any, Final, Self, cast

import numpy as np

from fmus.messages.records import RECEPTION, TRANSMISSION, frame, unframe
from orchestrator.errors import ComponentError
from orchestrator.parameters import ComponentType
from orchestrator.signal import Array, Causality, Signal, Signals
from orchestrator.timebase import Duration, Time

MILLISECOND: Final = 1_000_000
MICROSECOND: Final = 1_000
_NAME: Final = "channel"


class ChannelUnderTest:
    """Makes instances of the channel.

    Args:
        component_type: what is installed under the name `channel`.
    """

    def __init__(self, component_type: ComponentType) -> None:
        self._type = component_type

    def start(self, parameters: Mapping[str, Any], inputs: Signals, *, at: Time = 0) -> "Session":
        """A new instance.

        Args:
            parameters: those that differ from their defaults; choices by the name of the item.
            inputs: those that differ from their start values.
            at: the first communication point [ns].
        """
        return Session(self._type, {"seed": 1, **parameters}, inputs, at)


class Session:
    """One instance between its initialisation and its end; use it in a `with` statement.

    Whatever the instance raises becomes a `ComponentError` with the time.
    """

    def __init__(
        self, component_type: ComponentType, values: Mapping[str, Any], inputs: Signals, at: Time
    ) -> None:
        self._time = at
        try:
            self._component = component_type.create(_NAME, values)
        except Exception as error:
            raise ComponentError(_NAME, None, str(error)) from error
        self._inputs: dict[str, Signal] = {
            name: connector.start_value()
            for name, connector in self._component.connectors.items()
            if connector.causality is Causality.INPUT
        }
        self._change(inputs)
        try:
            self._component.setup(at, np.random.default_rng(0))
            self._component.initialise(self._inputs)
        except Exception as error:
            self._component.close()
            raise ComponentError(_NAME, at, str(error)) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._component.close()

    def _change(self, inputs: Signals) -> None:
        for name, value in inputs.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            self._inputs[name] = value

    def step(self, inputs: Signals, h: Duration = MILLISECOND) -> None:
        """Advance by `h` with these inputs; those not given stay as they are."""
        self._change(inputs)
        try:
            self._component.step(self._inputs, self._time, h)
        except Exception as error:
            raise ComponentError(_NAME, self._time, str(error)) from error
        self._time += h

    def send(self, packets: Array, inputs: Signals | None = None, *, h: Duration) -> Array:
        """Advance by `h` with these PACKET records as input; the RECEPTION records."""
        self.step({**(inputs or {}), "packets": frame("PKTS", packets)}, h)
        return self.receptions()

    def receptions(self) -> Array:
        """The RECEPTION records of the last step."""
        return unframe("RCPT", self._binary("receptions"), RECEPTION)

    def transmissions(self) -> Array:
        """The TRANSMISSION records of the last step."""
        return unframe("SENT", self._binary("transmissions"), TRANSMISSION)

    def probed(self, name: str) -> Array:
        """The output `probe.<name>`, shape (probe,)."""
        return cast("Array", self._component.outputs()[f"probe.{name}"])

    def _binary(self, name: str) -> bytes:
        return cast("bytes", self._component.outputs()[name])
