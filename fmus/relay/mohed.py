"""MoHeD, the relay policy of the paper: least NLOS risk by mobility and height."""

from dataclasses import dataclass, replace
from typing import Literal

from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.physics.propagation import wavelength
from fmus.relay.nodes import Node
from fmus.relay.obstacle_aware import ObstacleAwareParameters, ObstacleAwareSelection
from fmus.relay.obstacles import Obstacles
from fmus.relay.prediction import Horizon
from fmus.relay.risk import Ahead, RiskModel
from fmus.relay.situation import Choice, Situation
from orchestrator.parameters import parameter


class Mohed(ObstacleAwareSelection):
    """MoHeD: the relay of least NLOS risk by mobility and height of the obstacles.

    It knows what the ego knows: its own detections, the BSMs and APMs it received, and its
    map of the buildings. The choice is made when fusion is triggered, again after each
    window, and at once when the relay has not been heard for `lost_after`. With `trajectories`
    the obstacles count that will be on a hop, as the paper's section "Results & Analysis" says.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(ObstacleAwareParameters):
        """Parameters of the paper's section "Relay Selection", and its open readings."""

        minimum_speed_difference: float = parameter(
            0.5, unit="m/s", minimum=1e-6, doc="lower bound of |dv| in Eq. (3)"
        )
        carrier_frequency: float = parameter(5.9e9, unit="Hz", minimum=1e8, doc="of the radio")
        wall_loss: float = parameter(9.6, unit="dB", minimum=0.0, doc="per building wall")
        knife_edge_itu: bool = parameter(
            default=True, doc="factor 2 under the root of Eq. (1), as in ITU-R P.526"
        )
        first_hop: Literal["ends", "ego"] = parameter(
            "ends",
            doc="the velocities in Eq. (3) on the hop from the sharer to a candidate: those of "
            "its two ends, or of the candidate and the ego",
        )
        direct_link: bool = parameter(default=True, doc="whether the direct link can be chosen")
        keep_ties: bool = parameter(
            default=True,
            doc="whether the current choice wins among equal risks, before the direct link and "
            "then the relay with the shorter longest hop",
        )
        trajectories: bool = parameter(
            default=False,
            doc="whether the risk is the mean over the window, along predicted trajectories; "
            "else that of now",
        )
        sample: float = parameter(
            0.25,
            unit="s",
            minimum=0.01,
            doc="longest time between the instants of predicted trajectories",
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._given = parameters
        self._horizon = Horizon.within(parameters.window, parameters.sample)
        self._model = RiskModel(
            wavelength=wavelength(parameters.carrier_frequency),
            minimum_speed_difference=parameters.minimum_speed_difference,
            wall_loss=parameters.wall_loss,
            itu=parameters.knife_edge_itu,
        )

    @override
    def choose(self, situation: Situation) -> Choice:
        risks = self._risks(situation)
        if not self._given.keep_ties:
            situation = replace(situation, current=None)
        offered = risks if self._given.direct_link else situation.candidates
        best = situation.best({relay: -risks[relay] for relay in offered})
        return Choice(relay=best, risk_direct=risks[NO_VEHICLE], risk_chosen=risks[best])

    def _risks(self, situation: Situation) -> dict[int, float]:
        """The risk of the direct link, and of every candidate over both hops (step 4)."""
        ego, sharer = situation.ego, situation.sharer
        nodes = list(situation.candidates.values())
        pairs = [(sharer, ego), *((node, sharer) for node in nodes), *((n, ego) for n in nodes)]
        beside: list[Node] = [ego if self._given.first_hop == "ego" else sharer] * len(nodes)
        obstacles = self._surroundings.obstacles(situation)
        risk = self._model.of_hops(
            pairs,
            [ego, *beside, *([ego] * len(nodes))],
            obstacles,
            self._surroundings.walls(situation.known),
            self._ahead(situation, pairs, obstacles) if self._given.trajectories else None,
        ).tolist()
        first, second = risk[1 : len(nodes) + 1], risk[len(nodes) + 1 :]
        both = (one + other for one, other in zip(first, second, strict=True))
        return {NO_VEHICLE: risk[0], **dict(zip(situation.candidates, both, strict=True))}

    def _ahead(
        self, situation: Situation, pairs: list[tuple[Node, Node]], obstacles: Obstacles
    ) -> Ahead:
        """The predicted trajectories of the nodes and of the obstacles over the window."""
        return Ahead(
            hops=self._horizon.hops(pairs, situation.ego, situation.known.route),
            center=self._horizon.straight(obstacles.center, obstacles.velocity),
        )
