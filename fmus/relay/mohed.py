"""MoHeD, the relay policy of the paper: least NLOS risk by mobility and height."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.nodes import Node
from fmus.relay.policy import Choice, Policy, Situation
from fmus.relay.risk import SPEED_OF_LIGHT, RiskModel
from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.surroundings import Surroundings
from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import Time, nanoseconds


class Mohed(RelaySelection):
    """MoHeD: the relay of least NLOS risk by mobility and height of the obstacles.

    It knows what the ego knows: its own detections, the BSMs and APMs it received, and its
    map of the buildings. The choice is made when fusion is triggered, again after each
    window, and at once when the relay has not been heard for `lost_after`.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
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
        return LeastRisk(
            model,
            Surroundings(given.same_body, nanoseconds(given.lost_after)),
            ego_on_first_hop=given.first_hop == "ego",
            direct_link=given.direct_link,
            keep_ties=given.keep_ties,
        )


class LeastRisk(Policy):
    """The candidate, or the direct link, of least risk.

    Args:
        model: the risk of a hop.
        surroundings: what stands between the nodes.
        ego_on_first_hop: whether the ego's velocity stands beside the candidate's on the hop
            from the sharer, not the sharer's.
        direct_link: whether the direct link can be chosen while there are candidates.
        keep_ties: whether the current choice wins among equal risks.
    """

    def __init__(
        self,
        model: RiskModel,
        surroundings: Surroundings,
        *,
        ego_on_first_hop: bool,
        direct_link: bool,
        keep_ties: bool,
    ) -> None:
        self._model = model
        self._surroundings = surroundings
        self._ego_on_first_hop = ego_on_first_hop
        self._direct_link = direct_link
        self._keep_ties = keep_ties

    @override
    def remember(self, inputs: Signals, now: Time) -> None:
        self._surroundings.remember(inputs, now)

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        risks = self._risks(situation, inputs)
        if not self._keep_ties:
            situation = replace(situation, current=None)
        offered = risks.keys() - ({NO_VEHICLE} if not self._direct_link else set())
        best = min(
            offered or {NO_VEHICLE},
            key=lambda relay: (risks[relay], *situation.tie_break(relay)),
        )
        return Choice(relay=best, risk_direct=risks[NO_VEHICLE], risk_chosen=risks[best])

    def _risks(self, situation: Situation, inputs: Signals) -> dict[int, float]:
        """The risk of the direct link, and of every candidate over both hops (step 4)."""
        ego, sharer = situation.ego, situation.sharer
        nodes = list(situation.candidates.values())
        pairs = [(sharer, ego), *((node, sharer) for node in nodes), *((n, ego) for n in nodes)]
        beside: list[Node] = [ego if self._ego_on_first_hop else sharer] * len(nodes)
        risk = self._model.of_hops(
            pairs,
            [ego, *beside, *([ego] * len(nodes))],
            self._surroundings.obstacles(situation, inputs),
            self._surroundings.walls(inputs),
        ).tolist()
        first, second = risk[1 : len(nodes) + 1], risk[len(nodes) + 1 :]
        both = (one + other for one, other in zip(first, second, strict=True))
        return {NO_VEHICLE: risk[0], **dict(zip(situation.candidates, both, strict=True))}
