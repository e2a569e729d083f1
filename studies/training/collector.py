"""The policy that drives while samples are recorded: the expert, a network, or both in turns."""

import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.driving.network.checkpoint import read_network, shipped_or_none
from fmus.driving.network.cloud import Cloud, clouds
from fmus.driving.network.driver import ego_numbers
from fmus.driving.network.scan import scan_of
from fmus.driving.policy.command import Command
from fmus.driving.policy.connectors import connectors
from fmus.driving.policy.expert import EXPERT_READS, Expert, ExpertParameters
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.network import NetworkDriver
from fmus.driving.policy.occupancy import Vehicles
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.physics.plane import Frame
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.share import share
from orchestrator.signal import Array, Causality, Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds
from studies.training.learning.sample import BODY, SAMPLE_MIME, Sample, write_sample

_READS: Final = EXPERT_READS | {"points"}
_LISTENS: Final = _READS | {"received.features"}


def _connectors(reads: frozenset[str]) -> Mapping[str, Connector]:
    sample = Connector(
        causality=Causality.OUTPUT,
        dtype=None,
        mime_type=SAMPLE_MIME,
        feedthrough=_READS,
        description="scans, truth and the expert's command, after each scan; else empty",
    )
    return {**connectors(reads), "sample": sample}


@dataclass(frozen=True, slots=True, kw_only=True)
class DaggerParameters:
    """Parameters of the collecting policy."""

    network: str | Path = parameter(
        "",
        doc="that drives in turn with the expert; empty: the expert drives",
        names=shipped_or_none,
    )
    beta: float = share(1.0, doc="share of the turns in which the expert drives")
    turn: float = parameter(1.0, unit="s", minimum=0.05, doc="how long each of them drives")
    cruise_speed: float = parameter(30.0 / 3.6, unit="m/s", minimum=0.1, doc="speed to keep")
    overtaking: Overtaking | None = parameter(
        None, doc="when the expert passes on the lane of oncoming traffic; null: never"
    )
    disturbance: float = share(
        0.0,
        doc="share of the turns in which the wheel is pulled, so that the way back is seen, too",
    )
    disturbance_angle: float = share(0.05, doc="largest pull, as a steering command")
    maximum_age: float = parameter(
        1.0, unit="s", minimum=0.01, doc="older scans and features of such are not used"
    )
    points: int = parameter(
        0,
        minimum=0,
        maximum=65_536,
        doc="recorded of each scan at most, for point transformers, one per voxel of 0.5 m",
    )


class Dagger(Component):
    """Drives by the expert, by a network, or by both in turns, and says what the expert would do.

    Learning from what the expert says in situations that the network gets into is DAgger (Ross,
    Gordon and Bagnell, AISTATS 2011); with the expert alone it is behaviour cloning. The output
    `sample` has what `nlosim train` learns from.
    """

    Parameters: TypeAlias = DaggerParameters

    def __init__(self, parameters: DaggerParameters) -> None:
        self._parameters = parameters
        if parameters.points and importlib.util.find_spec("torch") is None:
            raise ComponentTypeError(
                "`points` are thinned with PyTorch, which is not installed; run "
                "`pip install 'nlosim[torch]'`, or write `points: 0`"
            )
        self._checkpoint = read_network(parameters.network) if parameters.network else None
        listens = self._checkpoint is not None and self._checkpoint.architecture.cooperative
        self._reads = _LISTENS if listens else _READS

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return _connectors(self._reads)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        given = self._parameters
        self._rng = rng
        self._expert = Expert(
            ExpertParameters(cruise_speed=given.cruise_speed, overtaking=given.overtaking)
        )
        self._expert.begin(start, rng)
        self._network = None
        if self._checkpoint is not None:
            self._network = NetworkDriver(
                self._checkpoint, given.cruise_speed, nanoseconds(given.maximum_age)
            )
        self._points = b""
        self._next_turn = start
        self._expert_drives = True
        self._pull = 0.0
        self._outputs: Signals = {**Command().signals(), "sample": b""}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now, known = t + h, Inputs.read(inputs, self._reads)
        if now >= self._next_turn:
            self._take_turns(now)
        taught = self._expert.drive(known, now).signals()
        command = np.array(taught["command"])
        if self._network is not None:
            wanted = self._network.command(known, now)
            command = command if self._expert_drives else wanted
        command[2] = min(max(command[2] + self._pull, -1.0), 1.0)
        self._outputs = {**taught, "command": command, "sample": self._sample(known, taught, now)}

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _take_turns(self, now: Time) -> None:
        given = self._parameters
        self._next_turn = now + nanoseconds(given.turn)
        draws = self._rng.random(3)
        self._expert_drives = bool(draws[0] < given.beta)
        self._pull = 0.0
        if draws[1] < given.disturbance:
            self._pull = given.disturbance_angle * float(2.0 * draws[2] - 1.0)

    def _sample(self, known: Inputs, taught: Signals, now: Time) -> bytes:
        ego = known.ego
        if known.points == self._points or not ego.has_route:
            return b""
        self._points = known.points
        fresh = [cloud for cloud in clouds(known.points) if cloud.time == now]
        if not fresh:
            return b""
        most = self._parameters.points
        frame = Frame.at(ego.position, ego.heading)
        return write_sample(
            Sample(
                time=now,
                ego=ego.vehicle,
                frame=frame,
                numbers=ego_numbers(frame, ego.speed, self._parameters.cruise_speed, ego.route),
                expert=np.asarray(taught["command"]),
                threat=int(taught["hazard.instance"]),
                scans=tuple(map(scan_of, fresh)),
                bodies=_bodies(known.vehicles),
                most_points=most,
                points=_thinned(fresh, most) if most else (),
            )
        )


def _thinned(fresh: Sequence[Cloud], most: int) -> tuple[Array, ...]:
    from fmus.driving.network.point_transformer import recorded_points  # noqa: PLC0415 - PyTorch

    return tuple(recorded_points(cloud, most) for cloud in fresh)


def _bodies(vehicles: Vehicles) -> Array:
    """BODY records of all vehicles."""
    bodies = np.zeros(len(vehicles.number), BODY)
    bodies["number"] = vehicles.number
    bodies["place"][:, :2] = vehicles.center
    bodies["place"][:, 2] = vehicles.heading
    bodies["size"] = vehicles.size
    bodies["velocity"] = vehicles.velocity
    return bodies
