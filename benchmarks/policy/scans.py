"""What the policy gets in the red-light scene, recorded while the expert drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from typing_extensions import override

import scenarios
from fmus.driving.network.cloud import Cloud, clouds
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.observer import Observer, SimulationResult
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import in_process
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import System, expand
from orchestrator.timebase import Duration, Time, nanoseconds

SCENARIO: Final = Path(scenarios.__file__).with_name("red_light_driving.yaml")
PERIOD: Final[Duration] = nanoseconds("0.1")
"""The time between two scans of a lidar."""

STARTS: Final[Mapping[str, Time]] = {
    "2s": nanoseconds("2"),  # 94 m before the crossing
    "6s": nanoseconds("6"),  # beside the rear of the queue
    "10s": nanoseconds("10"),  # 27 m before the crossing
    "14s": nanoseconds("14"),  # at its mouth
}
"""Where the drives begin that are measured, by name [ns]."""

SCANS: Final = 10
"""Scans of each drive, one second."""

EARLIER: Final = 4
"""Scans before each drive, so that the encoders have their history."""

_CHAIN: Final = ("traffic", "lidar", "policy")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """A time at which both lidars have just scanned.

    Attributes:
        time: [ns].
        inputs: of a policy, without what it received.
    """

    time: Time
    inputs: Signals

    @property
    def ego(self) -> int:
        """Number of the ego vehicle."""
        return int(self.inputs["ego.id"])

    def scans(self) -> tuple[Cloud, Cloud]:
        """The scans of the ego vehicle, and those of the sharing node."""
        found = {cloud.vehicle == self.ego: cloud for cloud in clouds(bytes(self.inputs["points"]))}
        return found[True], found[False]


def record(starts: Mapping[str, Time], scans: int = SCANS) -> Mapping[str, Sequence[Moment]]:
    """Drive through the scene once.

    Args:
        starts: of the drives that are wanted, by name [ns].
        scans: of each drive.

    Returns:
        Of each drive `EARLIER` moments, then `scans` of them.
    """
    scenario = load_scenario(SCENARIO, ["components.policy.type=policy-expert",
                                        "components.encoder.parameters.network=''"])  # fmt: skip
    recorder = _Recorder()
    simulate(
        _system(scenario),
        GaussSeidel(_CHAIN),
        start=scenario.start,
        stop=max(starts.values()) + scans * PERIOD,
        seed=scenario.seed,
        observers=[recorder],
    )
    times = {
        name: range(start - EARLIER * PERIOD, start + scans * PERIOD, PERIOD)
        for name, start in starts.items()
    }
    return {name: [recorder.moments[t] for t in wanted] for name, wanted in times.items()}


def _system(scenario: Scenario) -> System:
    """Traffic, lidars and the driver of a scenario, without radio and perception."""
    uses = {name: scenario.components[name] for name in _CHAIN}
    components = {name: in_process(use) for name, use in uses.items()}
    wires = [
        (wire.source, wire.target)
        for wire in scenario.connections
        if {wire.source.partition(".")[0], wire.target.partition(".")[0]} <= set(_CHAIN)
    ]
    connections = [each for wire in wires for each in expand(components, *wire)]
    return System(components, {name: use.step for name, use in uses.items()}, connections)


class _Recorder(Observer):
    """Keeps what the policy sees at every scan of both lidars."""

    def __init__(self) -> None:
        self.moments: dict[Time, Moment] = {}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if "lidar" not in published:
            return
        ego = {name: value for name, value in values["traffic"].items() if name.startswith("ego.")}
        self.moments[t] = Moment(time=t, inputs={**ego, "points": values["lidar"]["points"]})

    @override
    def end(self, result: SimulationResult) -> None:
        pass
