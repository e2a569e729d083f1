"""No relay: the baseline of the paper's Table II."""

from typing_extensions import override

from fmus.relay.unit import RelayUnit
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


class Direct(RelayUnit):
    """No relay: the sharer's data take the direct link to the ego."""

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        pass
