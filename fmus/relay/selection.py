"""When relays are chosen, whatever the policy: at the trigger, per window, and on loss."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.connectors import CONNECTORS, OUTPUTS
from fmus.relay.nodes import Node, Whereabouts, ego_node, neighbours
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
        0.5, unit="s", minimum=0.001, doc="who was not heard for longer is no candidate or relay"
    )


class Course:
    """The choice in force, whom it is for, and how often it changed while fusion was triggered.

    Attributes:
        relay: `NO_VEHICLE` for the direct link.
        sharer: `NO_VEHICLE` while fusion is not triggered.
        outputs: of a relay component.
    """

    def __init__(self) -> None:
        self.relay = NO_VEHICLE
        self.sharer = NO_VEHICLE
        self.outputs: Signals = {name: output.start_value() for name, output in OUTPUTS.items()}
        self._switches = 0

    def is_new(self, sharer: int) -> bool:
        """Whether a choice for `sharer` is the first after a trigger."""
        return sharer != self.sharer

    def pause(self) -> None:
        """Fusion is not triggered; the choice stays, but counts no more as one to keep."""
        self.sharer = NO_VEHICLE

    def take(self, choice: Choice, sharer: int) -> None:
        """Make `choice`; one that differs from the last for the same sharer is a switch."""
        if sharer == self.sharer != NO_VEHICLE and choice.relay != self.relay:
            self._switches += 1
        self.relay, self.sharer = choice.relay, sharer
        self.outputs = {
            "relay": np.array(choice.relay, np.int64),
            "switches": np.array(self._switches, np.int64),
            "risk.direct": np.array(choice.risk_direct),
            "risk.chosen": np.array(choice.risk_chosen),
        }


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
        self._course = Course()
        self._rule = self._policy(rng)
        self._whereabouts = Whereabouts()
        self._next_choice = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now = t + h
        self._whereabouts.update(inputs, now)
        self._rule.remember(inputs, now)
        sharer = wanted_sharer(inputs)
        if sharer == NO_VEHICLE:
            self._course.pause()
            return
        is_due = self._course.is_new(sharer) or now >= self._next_choice
        if is_due or self._relay_is_lost(inputs):
            self._course.take(self._choose(inputs, sharer, now), sharer)
            self._next_choice = now + nanoseconds(self._common.window)

    @override
    def outputs(self) -> Signals:
        return self._course.outputs

    def _choose(self, inputs: Signals, sharer: int, now: Time) -> Choice:
        current = None if self._course.is_new(sharer) else self._course.relay
        found = situation(inputs, self._whereabouts.of(sharer, now), current, self._common)
        return Choice() if found is None else self._rule.choose(found, inputs)

    def _relay_is_lost(self, inputs: Signals) -> bool:
        if self._course.relay == NO_VEHICLE:
            return False
        heard = np.asarray(inputs["received.bsm.id"]) == self._course.relay
        ages = np.asarray(inputs["received.bsm.age"])[heard]
        return len(ages) == 0 or bool(ages[0] > self._common.lost_after)


def wanted_sharer(inputs: Signals) -> int:
    """The best sharer while fusion is triggered, else `NO_VEHICLE`."""
    sharers = np.asarray(inputs["match.sharer"])
    return int(sharers[0]) if inputs["match.trigger"] and len(sharers) else NO_VEHICLE


def situation(
    inputs: Signals, sharer: Node | None, current: int | None, given: SelectionParameters
) -> Situation | None:
    """Who is to be connected, and the candidates for it; the same for every policy.

    Args:
        inputs: of the relay component.
        sharer: where it was last known.
        current: as in `Situation`.
        given: which limits candidates have to keep.

    Returns:
        None if the sharer has never been heard: there is nothing to compare.
    """
    if sharer is None:
        return None
    ego, far = ego_node(inputs), given.maximum_range
    candidates = {
        vehicle: node
        for vehicle, node in neighbours(inputs, given.lost_after).items()
        if vehicle not in {sharer.vehicle, ego.vehicle}
        and max(sharer.distance(node), node.distance(ego)) <= far
    }
    return Situation(ego=ego, sharer=sharer, candidates=candidates, current=current)
