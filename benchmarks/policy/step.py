"""A step of the policy: the sharer encodes its scan, the ego vehicle its own, and decides."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import process_time_ns
from typing import Final

from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.policy.scans import EARLIER, PERIOD, Moment
from fmus.driving.network.checkpoint import Checkpoint
from fmus.driving.network.sensors import Sender
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.network import NetworkDriver, network_reads
from fmus.messages.features import FeaturesMessage, write_features
from orchestrator.signal import Signals
from orchestrator.timebase import nanoseconds

NS_PER_MS: Final = 1e6
_WANTED_SPEED: Final = 30.0 / 3.6
_MAXIMUM_AGE: Final = nanoseconds("1")
_KNOWN_SCANS: Final = 2
"""Messages that the ego vehicle knows at a time, as in the scenario (`received_scans`)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lap:
    """CPU times of one scan [ns]: of the sharer, of the ego vehicle, and of it half a period on."""

    sharer: int
    ego: int
    fusion: int


@dataclass(frozen=True, kw_only=True, eq=False)
class StepRun(Case):
    """Scan after scan of a drive, by the code that the components `encoder` and `policy` run.

    Attributes:
        moments: of the drive, `EARLIER` ones first that are not timed.
        checkpoint: the network.
    """

    moments: Sequence[Moment]
    checkpoint: Checkpoint

    @override
    def measure(self) -> Measurement:
        """Drive once.

        Returns:
            CPU time per scan: `sharer_ms`, from the sharer's points to its message; `ego_ms`, from
            the ego vehicle's points and the messages to the command; `step_ms`, both. `fusion_ms`
            is the next step, half a period later, when nothing new has come: fusion and head.
            `points` of both scans.
        """
        found = _Drive(self.checkpoint)
        laps = [found.lap(moment) for moment in self.moments][EARLIER:]
        clouds = [cloud for moment in self.moments[EARLIER:] for cloud in moment.scans()]
        per_lap = 1.0 / (NS_PER_MS * len(laps))
        return {
            "step_ms": per_lap * sum(lap.sharer + lap.ego for lap in laps),
            "sharer_ms": per_lap * sum(lap.sharer for lap in laps),
            "ego_ms": per_lap * sum(lap.ego for lap in laps),
            "fusion_ms": per_lap * sum(lap.fusion for lap in laps),
            "points": sum(len(cloud.x) for cloud in clouds) / len(laps),
        }


class _Drive:
    """Sharer and ego vehicle, which remember their scans; nothing is lost between them."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        self._sender = Sender(checkpoint)
        self._driver = NetworkDriver(checkpoint, _WANTED_SPEED, _MAXIMUM_AGE)
        self._reads = network_reads(checkpoint.architecture)
        self._messages: list[FeaturesMessage] = []

    def lap(self, moment: Moment) -> _Lap:
        begin = process_time_ns()
        _, cloud = moment.scans()
        message = self._sender.message(cloud)
        sharer = process_time_ns() - begin
        self._messages = [*self._messages, message][-_KNOWN_SCANS:]
        inputs = {**moment.inputs, "received.features": write_features(self._messages)}
        ego = self._command(inputs, moment.time)
        fusion = self._command(inputs, moment.time + PERIOD // 2)
        return _Lap(sharer=sharer, ego=ego, fusion=fusion)

    def _command(self, inputs: Signals, now: int) -> int:
        """How long it takes to find the command [ns]."""
        begin = process_time_ns()
        self._driver.command(Inputs.read(inputs, self._reads), now)
        return process_time_ns() - begin
