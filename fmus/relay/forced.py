"""Given relays: choices made elsewhere, played again."""

from bisect import bisect_right
from dataclasses import dataclass

from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.inputs import Inputs
from fmus.relay.situation import Choice
from fmus.relay.unit import RelayUnit
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time, nanoseconds


class Forced(RelayUnit):
    """Relays that are given, each from its time on; the direct link before the first.

    A change while fusion is triggered for the same sharer is a switch, as with policies.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """The choices, in order of time."""

        times: tuple[float, ...] = parameter(
            (), unit="s", doc="from when on each choice is in force, ascending"
        )
        relays: tuple[int, ...] = parameter(
            (), minimum=NO_VEHICLE, doc="the vehicle chosen at each time, -1 for the direct link"
        )

    def __init__(self, parameters: Parameters) -> None:
        times, relays = parameters.times, parameters.relays
        if len(times) != len(relays):
            raise ComponentTypeError(
                f"`relays` has {len(relays)} entries and `times` {len(times)}; "
                "give one time for each relay"
            )
        self._times = [nanoseconds(time) for time in times]
        if any(b <= a for a, b in zip(self._times, self._times[1:], strict=False)):
            raise ComponentTypeError("`times` must ascend; sort the choices, each time once")
        self._relays = (NO_VEHICLE, *relays)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        relay = self._relays[bisect_right(self._times, t + h)]
        sharer = Inputs.read(inputs).wanted_sharer
        if self._course.is_new(sharer) or relay != self._course.relay:
            self._course.take(Choice(relay=relay), sharer)
