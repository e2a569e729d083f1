"""Relay selection by signal strength, the paper's rival from 3GPP Release 18."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from typing_extensions import override

from fmus.relay.policy import Choice, Policy, Situation
from fmus.relay.selection import RelaySelection, SelectionParameters
from orchestrator.parameters import parameter
from orchestrator.signal import Signals


class SignalStrength(RelaySelection):
    """The relay whose two hops were received most strongly.

    The power of the hop to the ego is what the ego measures of the candidate's BSMs; that of
    the sharer's hop is what the candidate announces in them. The choice is made when MoHeD
    makes it; candidates are MoHeD's of which both powers are known.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """How the powers of two hops become one figure of merit."""

        rule: Literal["sum", "min"] = parameter(
            "sum", doc="figure of merit: the sum of both hops' powers in dBm, or the smaller"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._parameters = parameters

    @override
    def _policy(self, rng: np.random.Generator) -> Policy:
        return SumOfHops() if self._parameters.rule == "sum" else WeakerHop()


class SumOfHops(Policy):
    """The candidate with the largest sum of both hops' powers ("in-sum strongest")."""

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        powers = powers_of_hops(situation, inputs)
        return _largest({relay: sum(hops) for relay, hops in powers.items()}, situation)


class WeakerHop(Policy):
    """The candidate whose weaker hop is strongest."""

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        powers = powers_of_hops(situation, inputs)
        return _largest({relay: min(hops) for relay, hops in powers.items()}, situation)


def powers_of_hops(situation: Situation, inputs: Signals) -> dict[int, tuple[float, float]]:
    """What the ego knows of the candidates' links.

    Args:
        situation: the candidates and the sharer.
        inputs: with `received.link.*`.

    Returns:
        Received powers of the hops from the sharer and to the ego [dBm], by candidate;
        candidates of which one is not known are left out.
    """
    transmitters = np.asarray(inputs["received.link.transmitter"]).tolist()
    receivers = np.asarray(inputs["received.link.receiver"]).tolist()
    powers = np.asarray(inputs["received.link.power"]).tolist()
    known = dict(zip(zip(transmitters, receivers, strict=True), powers, strict=True))
    sharer, ego = situation.sharer.vehicle, situation.ego.vehicle
    return {
        relay: (known[sharer, relay], known[relay, ego])
        for relay in situation.candidates
        if (sharer, relay) in known and (relay, ego) in known
    }


def _largest(merits: Mapping[int, float], situation: Situation) -> Choice:
    """The direct link where no candidate has a figure of merit."""
    if not merits:
        return Choice()
    best = min(merits, key=lambda relay: (-merits[relay], *situation.tie_break(relay)))
    return Choice(relay=best)
