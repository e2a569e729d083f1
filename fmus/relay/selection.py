"""When relays are chosen, whatever the policy: at the trigger, per window, and on loss."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.records import NO_VEHICLE
from fmus.relay.connectors import CONNECTORS, OUTPUTS
from fmus.relay.nodes import Whereabouts, ego_node, neighbours
from fmus.relay.policy import Choice, Policy, Situation
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionParameters:
    """Parameters of every policy that can choose a relay."""

    window: float = parameter(2.0, unit="s", minimum=0.001, doc="time between re-selections")
    maximum_range: float = parameter(
        300.0, unit="m", minimum=1.0, doc="candidates with a longer hop are not considered"
    )
    lost_after: float = parameter(
        0.5, unit="s", minimum=0.001, doc="a relay not heard for so long is given up"
    )


class RelaySelection(Component):
    """Chooses when fusion is triggered, after each window, and at once when the relay is lost.

    A relay is lost when it has not been heard for `lost_after`. It knows what the ego knows:
    its own detections, the messages it received, and its map of the buildings.
    """

    def __init__(self, parameters: SelectionParameters) -> None:
        self._common = parameters

    @abc.abstractmethod
    def _policy(self, rng: np.random.Generator) -> Policy:
        """The policy, at the start of a run."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._outputs = {name: output.start_value() for name, output in OUTPUTS.items()}
        self._rule = self._policy(rng)
        self._whereabouts = Whereabouts()
        self._relay = NO_VEHICLE
        self._sharer = NO_VEHICLE
        self._next_choice = start
        self._switches = 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now = t + h
        self._whereabouts.update(inputs)
        self._rule.remember(inputs, now)
        sharer = _wanted_sharer(inputs)
        if sharer == NO_VEHICLE:
            self._sharer = NO_VEHICLE
            return
        first_choice = sharer != self._sharer
        if first_choice or now >= self._next_choice or self._relay_is_lost(inputs):
            self._select(inputs, sharer, now, first_choice=first_choice)

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _select(self, inputs: Signals, sharer: int, now: Time, *, first_choice: bool) -> None:
        current = None if first_choice else self._relay
        choice = self._choose(inputs, sharer, current)
        if current is not None and choice.relay != current:
            self._switches += 1
        self._relay, self._sharer = choice.relay, sharer
        self._next_choice = now + nanoseconds(self._common.window)
        self._outputs = {
            "relay": np.array(choice.relay, np.int64),
            "switches": np.array(self._switches, np.int64),
            "risk.direct": np.array(choice.risk_direct),
            "risk.chosen": np.array(choice.risk_chosen),
        }

    def _choose(self, inputs: Signals, sharer: int, current: int | None) -> Choice:
        source = self._whereabouts.of(sharer)
        if source is None:  # the sharer has never been heard: nothing to compare
            return Choice()
        ego = ego_node(inputs)
        far = self._common.maximum_range
        within_range = {
            vehicle: node
            for vehicle, node in sorted(neighbours(inputs).items())
            if vehicle not in {sharer, ego.vehicle}
            and max(source.distance(node), node.distance(ego)) <= far
        }
        situation = Situation(ego=ego, sharer=source, candidates=within_range, current=current)
        return self._rule.choose(situation, inputs)

    def _relay_is_lost(self, inputs: Signals) -> bool:
        if self._relay == NO_VEHICLE:
            return False
        heard = np.asarray(inputs["received.bsm.id"]) == self._relay
        ages = np.asarray(inputs["received.bsm.age"])[heard]
        return len(ages) == 0 or bool(ages[0] > self._common.lost_after)


def _wanted_sharer(inputs: Signals) -> int:
    """The best sharer while fusion is triggered, else `NO_VEHICLE`."""
    sharers = np.asarray(inputs["match.sharer"])
    return int(sharers[0]) if inputs["match.trigger"] and len(sharers) else NO_VEHICLE
