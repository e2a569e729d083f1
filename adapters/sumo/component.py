"""The component: SUMO traffic around an ego vehicle that the driving policy drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.sumo.connectors import CONNECTORS
from adapters.sumo.ego import Command
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.simulation import Sumo
from adapters.sumo.traffic import Traffic
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

_MILLISECOND = nanoseconds("0.001")
_FARTHEST = 1e5
"""From the origin [m]: farther is a mistake in writing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What traffic reads.

    Attributes:
        command: what the driving policy asks of the ego vehicle.
    """

    command: Command

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The view of the inputs of traffic.

        Raises:
            ValueError: the command is not finite.
        """
        return cls(command=Command.of(np.asarray(signals["command"], np.float64)))


class SumoTraffic(Component):
    """SUMO traffic at an intersection, an ego vehicle to be driven and one that runs a red light.

    The ego vehicle's command acts in the step that follows: no output depends on an input at the
    same communication point. Nothing happens to bodies that overlap: the collision is reported,
    and both drive on.
    """

    Parameters: TypeAlias = TrafficParameters

    def __init__(self, parameters: TrafficParameters) -> None:
        _check(parameters)
        self._parameters = parameters
        self._step_length = nanoseconds(parameters.step_length)
        self._sumo: Sumo | None = None
        self._traffic: Traffic | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.close()
        seed = int(rng.integers(2**31))
        self._sumo = Sumo(self._parameters.scene, self._step_length, seed)
        # the programme of the traffic light begins with the run, whatever the time is
        self._traffic = Traffic(self._sumo, self._parameters, rng, start)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        count, rest = divmod(h, self._step_length)
        if rest or not count:
            raise ValueError(
                f"the communication step size is {h / 1e9:g} s, which is not a whole multiple of "
                f"SUMO's step, `step_length` = {self._parameters.step_length:g} s; "
                "change one of them"
            )
        assert self._traffic is not None  # noqa: S101  (the contract: `setup` comes first)
        self._traffic.advance(Inputs.read(inputs).command, count)

    @override
    def outputs(self) -> Signals:
        assert self._traffic is not None  # noqa: S101
        return self._traffic.outputs

    @override
    def close(self) -> None:
        self._traffic = None
        if self._sumo is not None:
            self._sumo.close()
            self._sumo = None


def _check(parameters: TrafficParameters) -> None:
    """Refuse parameters that do not fit together.

    Raises:
        ComponentTypeError: all that is wrong, one sentence each.
    """
    problems = []
    if not parameters.scene.is_file():
        problems.append(f"`scene`: there is no file `{parameters.scene}`; name a *.sumocfg file")
    try:
        step_length = nanoseconds(parameters.step_length)
    except ValueError:
        step_length = 1
    if step_length % _MILLISECOND:
        problems.append(
            f"`step_length` is {parameters.step_length:g} s; SUMO counts whole milliseconds"
        )
    if parameters.collider_min_speed > parameters.collider_max_speed:
        problems.append("`collider_min_speed` is above `collider_max_speed`")
    if parameters.collider_spread >= parameters.collider_speed:
        problems.append("`collider_spread` must be smaller than `collider_speed`")
    problems += _misplaced(parameters.rsu_positions)
    if problems:
        raise ComponentTypeError("\n".join(problems))


def _misplaced(positions: Sequence[Sequence[float]]) -> list[str]:
    """What is wrong with the positions of roadside units, whatever the scene."""
    problems = []
    for k, position in enumerate(positions):
        place = f"`rsu_positions`: entry {k} is {list(position)}"
        if len(position) != 2:
            problems.append(f"{place}; write x and y, for example [14 m, 9 m]")
        elif not all(abs(x) <= _FARTHEST for x in position):  # false for NaN
            problems.append(f"{place}; x and y must be finite and within +-{_FARTHEST:g} m")
        elif position in positions[:k]:
            problems.append(f"{place}, the same place as another one; leave one out")
    return problems


__all__ = ["SumoTraffic"]
