"""Relay selection by signal strength, the paper's rival from 3GPP Release 18."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from typing_extensions import override

from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.situation import Choice, Situation
from orchestrator.parameters import parameter

_MERITS: Final = {"sum": np.add, "min": np.minimum}
"""How the powers of two hops [dBm] become one figure of merit; NaN if one is not known."""


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
        self._merit = _MERITS[parameters.rule]

    @override
    def choose(self, situation: Situation) -> Choice:
        links, candidates = situation.known.links, np.array(list(situation.candidates), np.int64)
        from_sharer = links.power(np.array(situation.sharer.vehicle), candidates)
        to_ego = links.power(candidates, np.array(situation.ego.vehicle))
        merits = self._merit(from_sharer, to_ego).tolist()
        return Choice(relay=situation.best(dict(zip(situation.candidates, merits, strict=True))))
