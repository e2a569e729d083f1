"""MoHeD, the relay policy of the paper: least NLOS risk by mobility and height."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.apm import decode, split
from fmus.records import NO_VEHICLE, OBJECT, unframe
from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles, from_bsms, from_layer, from_objects, merge
from fmus.relay.policy import Choice, Policy, Situation
from fmus.relay.risk import SPEED_OF_LIGHT, RiskModel
from fmus.relay.selection import RelaySelection, SelectionParameters
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Signals
from orchestrator.timebase import Duration, Time, nanoseconds


class Mohed(RelaySelection):
    """MoHeD: the relay of least NLOS risk by mobility and height of the obstacles.

    It knows what the ego knows: its own detections, the BSMs and APMs it received, and its
    map of the buildings. The choice is made when fusion is triggered, again after each
    window, and at once when the relay has not been heard for `lost_after`.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """Parameters of the paper's section "Relay Selection"."""

        minimum_speed_difference: float = parameter(
            0.5, unit="m/s", minimum=1e-6, doc="lower bound of |dv| in Eq. (3)"
        )
        carrier_frequency: float = parameter(5.9e9, unit="Hz", minimum=1e8, doc="of the radio")
        wall_loss: float = parameter(9.6, unit="dB", minimum=0.0, doc="per building wall")
        knife_edge_itu: bool = parameter(
            default=True, doc="factor 2 under the root of Eq. (1), as in ITU-R P.526"
        )
        same_body: float = parameter(
            1.0, unit="m", minimum=0.0, doc="distance at which two sources mean one obstacle"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._parameters = parameters

    @override
    def _policy(self, rng: np.random.Generator) -> Policy:
        given = self._parameters
        model = RiskModel(
            wavelength=SPEED_OF_LIGHT / given.carrier_frequency,
            minimum_speed_difference=given.minimum_speed_difference,
            wall_loss=given.wall_loss,
            itu=given.knife_edge_itu,
        )
        return LeastRisk(model, given.same_body, nanoseconds(given.lost_after))


class LeastRisk(Policy):
    """The candidate, or the direct link, of least risk.

    Args:
        model: the risk of a hop.
        same_body: distance at which two sources mean one obstacle [m].
        layer_lifetime: how long the layer of an APM counts after its scan [ns].
    """

    def __init__(self, model: RiskModel, same_body: float, layer_lifetime: Duration) -> None:
        self._model = model
        self._same_body = same_body
        self._layer_lifetime = layer_lifetime
        self._layers: dict[int, tuple[Time, Obstacles, float]] = {}
        self._walls: Array = np.empty((0, 2, 2))
        self._map: object = None

    @override
    def remember(self, inputs: Signals, now: Time) -> None:
        ego = int(np.asarray(inputs["ego.id"]))
        for apm in map(decode, split(bytes(inputs["received.apms"]))):
            if apm.vehicle != ego:
                self._layers[apm.vehicle] = (apm.time, from_layer(apm), apm.cell)
        oldest = now - self._layer_lifetime
        self._layers = {v: kept for v, kept in self._layers.items() if kept[0] >= oldest}

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        risks = self._risks(situation, inputs)
        best = min(risks, key=lambda relay: (risks[relay], *situation.tie_break(relay)))
        return Choice(relay=best, risk_direct=risks[NO_VEHICLE], risk_chosen=risks[best])

    def _risks(self, situation: Situation, inputs: Signals) -> dict[int, float]:
        """The risk of the direct link, and of every candidate over both hops (step 4)."""
        ego, source = situation.ego, situation.sharer
        obstacles = self._obstacles(inputs, ego)
        walls = self._wall_segments(inputs)
        risks = {NO_VEHICLE: self._model.of_link(source, ego, ego, obstacles, walls)}
        for vehicle, node in situation.candidates.items():
            first_hop = self._model.of_link(source, node, node, obstacles, walls)
            risks[vehicle] = first_hop + self._model.of_link(node, ego, ego, obstacles, walls)
        return risks

    def _obstacles(self, inputs: Signals, ego: Node) -> Obstacles:
        """Steps 1 to 3 of the paper: locate, merge, keep what is an obstacle."""
        objects = unframe("OBJS", bytes(inputs["objects"]), OBJECT)
        own = from_objects(objects[objects["sensor"] == ego.vehicle])
        margin = self._same_body
        layers = [(layer, cell / 2.0) for _, layer, cell in self._layers.values()]
        return merge(
            [(_own_body(inputs, ego), margin), (from_bsms(inputs), margin), (own, margin), *layers]
        )

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
