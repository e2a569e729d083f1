"""Relay policies: MoHeD and the direct link."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import override

from fmus.apm import decode, split
from fmus.records import NO_VEHICLE, OBJECT, unframe
from fmus.relay.connectors import CONNECTORS, OUTPUTS
from fmus.relay.obstacles import Obstacles, from_bsms, from_layer, from_objects, merge
from fmus.relay.risk import SPEED_OF_LIGHT, Node, RiskModel
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A way from the sharer to the ego; the most preferred one is chosen."""

    risk: float
    longest_hop: float
    relay: int

    def preference(self, current: int | None) -> tuple[float, bool, bool, float, int]:
        """The sort key of the choice.

        Least risk first; the paper leaves ties open: one keeps the current choice, then
        prefers the direct link, then the relay whose longer hop is shorter.
        """
        is_relay = self.relay != NO_VEHICLE
        return (self.risk, self.relay != current, is_relay, self.longest_hop, self.relay)


class Direct(Component):
    """No relay: the sharer's data take the direct link to the ego."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._outputs = {name: output.start_value() for name, output in OUTPUTS.items()}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        pass

    @override
    def outputs(self) -> Signals:
        return self._outputs


class Mohed(Component):
    """MoHeD: the relay of least NLOS risk by mobility and height of the obstacles.

    It knows what the ego knows: its own detections, the BSMs and APMs it received, and its
    map of the buildings. The choice is made when fusion is triggered, again after each
    window, and at once when the relay has not been heard for `lost_after`.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """Parameters of the paper's section "Relay Selection"."""

        window: float = parameter(2.0, unit="s", minimum=0.001, doc="time between re-selections")
        minimum_speed_difference: float = parameter(
            0.5, unit="m/s", minimum=1e-6, doc="lower bound of |dv| in Eq. (3)"
        )
        carrier_frequency: float = parameter(5.9e9, unit="Hz", minimum=1e8, doc="of the radio")
        wall_loss: float = parameter(9.6, unit="dB", minimum=0.0, doc="per building wall")
        knife_edge_itu: bool = parameter(
            default=True, doc="factor 2 under the root of Eq. (1), as in ITU-R P.526"
        )
        maximum_range: float = parameter(
            300.0, unit="m", minimum=1.0, doc="candidates with a longer hop are not considered"
        )
        lost_after: float = parameter(
            0.5, unit="s", minimum=0.001, doc="a relay not heard for so long is given up"
        )
        same_body: float = parameter(
            1.0, unit="m", minimum=0.0, doc="distance at which two sources mean one obstacle"
        )

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._risk = RiskModel(
            wavelength=SPEED_OF_LIGHT / parameters.carrier_frequency,
            minimum_speed_difference=parameters.minimum_speed_difference,
            wall_loss=parameters.wall_loss,
            itu=parameters.knife_edge_itu,
        )

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._outputs = {name: output.start_value() for name, output in OUTPUTS.items()}
        self._layers: dict[int, tuple[Time, Obstacles, float]] = {}
        self._last_known: dict[int, Node] = {}
        self._choice = _Candidate(0.0, 0.0, NO_VEHICLE)
        self._sharer = NO_VEHICLE
        self._next_choice = start
        self._switches = 0
        self._walls: Array = np.empty((0, 2, 2))
        self._map: object = None

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now = t + h
        self._remember(inputs, now)
        sharer = int(np.asarray(inputs["match.sharer"])[0]) if inputs["match.trigger"] else -1
        if sharer == NO_VEHICLE:
            self._sharer = NO_VEHICLE
            return
        first_choice = sharer != self._sharer
        if first_choice or now >= self._next_choice or self._relay_is_lost(inputs):
            self._choose(inputs, sharer, now, first_choice=first_choice)

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _choose(self, inputs: Signals, sharer: int, now: Time, *, first_choice: bool) -> None:
        candidates = self._candidates(inputs, sharer)
        current = None if first_choice else self._choice.relay
        best = min(candidates, key=lambda candidate: candidate.preference(current))
        if not first_choice and best.relay != self._choice.relay:
            self._switches += 1
        self._choice, self._sharer = best, sharer
        self._next_choice = now + nanoseconds(self._parameters.window)
        direct = next((c.risk for c in candidates if c.relay == NO_VEHICLE), 0.0)
        self._outputs = {
            "relay": np.array(best.relay, np.int64),
            "switches": np.array(self._switches, np.int64),
            "risk.direct": np.array(direct),
            "risk.chosen": np.array(best.risk),
        }

    def _candidates(self, inputs: Signals, sharer: int) -> list[_Candidate]:
        """The direct link and every neighbour, with the risk of both hops (step 4)."""
        nodes = _nodes(inputs)
        ego = _ego(inputs)
        nodes.pop(sharer, None)
        source = self._last_known.get(sharer)
        if source is None:  # the sharer has never been heard: nothing to compare
            return [_Candidate(0.0, 0.0, NO_VEHICLE)]
        obstacles = self._obstacles(inputs, ego)
        walls = self._wall_segments(inputs)
        far = self._parameters.maximum_range
        found = [
            _Candidate(
                self._risk.of_link(source, ego, ego, obstacles, walls),
                _distance(source, ego),
                NO_VEHICLE,
            )
        ]
        for vehicle, node in nodes.items():
            longest = max(_distance(source, node), _distance(node, ego))
            if vehicle != ego.vehicle and longest <= far:
                risk = self._risk.of_link(source, node, node, obstacles, walls)
                risk += self._risk.of_link(node, ego, ego, obstacles, walls)
                found.append(_Candidate(risk, longest, vehicle))
        return found

    def _obstacles(self, inputs: Signals, ego: Node) -> Obstacles:
        """Steps 1 to 3 of the paper: locate, merge, keep what is an obstacle."""
        objects = unframe("OBJS", bytes(inputs["objects"]), OBJECT)
        own = from_objects(objects[objects["sensor"] == ego.vehicle])
        margin = self._parameters.same_body
        layers = [(layer, cell / 2.0) for _, layer, cell in self._layers.values()]
        return merge(
            [(_own_body(inputs, ego), margin), (from_bsms(inputs), margin), (own, margin), *layers]
        )

    def _remember(self, inputs: Signals, now: Time) -> None:
        """Keep the layers of APMs, and where nodes were last heard.

        A sharer whose own BSMs are shadowed is still known: its APMs, which come over the
        relay, carry its position.
        """
        ego = int(np.asarray(inputs["ego.id"]))
        heard = _nodes(inputs)
        self._last_known |= heard
        for message in split(bytes(inputs["received.apms"])):
            apm = decode(message)
            if apm.vehicle == ego:
                continue
            self._layers[apm.vehicle] = (apm.time, from_layer(apm), apm.cell)
            if apm.vehicle in self._last_known and apm.vehicle not in heard:
                node = self._last_known[apm.vehicle]
                self._last_known[apm.vehicle] = replace(node, position=apm.position)
        oldest = now - nanoseconds(self._parameters.lost_after)
        self._layers = {v: kept for v, kept in self._layers.items() if kept[0] >= oldest}

    def _relay_is_lost(self, inputs: Signals) -> bool:
        if self._choice.relay == NO_VEHICLE:
            return False
        heard = np.asarray(inputs["received.bsm.id"]) == self._choice.relay
        ages = np.asarray(inputs["received.bsm.age"])[heard]
        return len(ages) == 0 or bool(ages[0] > self._parameters.lost_after)

    def _wall_segments(self, inputs: Signals) -> Array:
        """Both ends of every building wall, (wall, 2, 2); built once per map."""
        vertex, index = np.asarray(inputs["building.vertex"]), np.asarray(inputs["building.index"])
        if self._map is not inputs["building.vertex"]:
            following = np.arange(1, len(index) + 1)
            starts = np.searchsorted(index, index)
            last = np.append(index[1:] != index[:-1], [True])[: len(index)]
            following[last] = starts[last]
            self._walls = np.stack([vertex, vertex[following]], axis=1) if len(index) else vertex
            self._map = inputs["building.vertex"]
        return self._walls


def _nodes(inputs: Signals) -> dict[int, Node]:
    """The neighbours by their BSMs, moved on by the age of the message."""
    position = np.asarray(inputs["received.bsm.position"])
    velocity = np.asarray(inputs["received.bsm.velocity"])
    age = np.asarray(inputs["received.bsm.age"])
    antenna = np.asarray(inputs["received.bsm.antenna_height"])
    return {
        int(vehicle): Node(
            vehicle=int(vehicle),
            position=position[row] + age[row] * velocity[row],
            velocity=velocity[row],
            antenna_height=float(antenna[row]),
        )
        for row, vehicle in enumerate(np.asarray(inputs["received.bsm.id"]))
    }


def _ego(inputs: Signals) -> Node:
    heading = float(np.asarray(inputs["ego.heading"]))
    speed = float(np.asarray(inputs["ego.speed"]))
    return Node(
        vehicle=int(np.asarray(inputs["ego.id"])),
        position=np.asarray(inputs["ego.position"]),
        velocity=speed * np.array([np.cos(heading), np.sin(heading)]),
        antenna_height=float(np.asarray(inputs["ego.size"])[2]),
    )


def _own_body(inputs: Signals, ego: Node) -> Obstacles:
    """The ego's body: it explains what others see of it, and can stand between others."""
    size = np.asarray(inputs["ego.size"])
    return Obstacles(
        owner=np.array([ego.vehicle]),
        center=ego.position[None],
        heading=np.asarray(inputs["ego.heading"])[None],
        half=size[None, :2] / 2.0,
        height=size[2:],
        velocity=ego.velocity[None],
    )


def _distance(first: Node, second: Node) -> float:
    return float(np.linalg.norm(second.position - first.position))
