"""Relay selection by signal strength, the paper's rival from 3GPP Release 18."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.situation import Choice, Situation
from orchestrator.parameters import parameter
from orchestrator.signal import Array

_MERITS: Final[Mapping[str, Callable[[Array, Array], Array]]] = {
    "sum": np.add,
    "min": np.minimum,
    "own": lambda _from_sharer, to_ego: to_ego,
}
"""How the powers from the sharer and to the ego [dBm] become one figure of merit."""


class SignalStrength(RelaySelection):
    """The relay whose hops were received most strongly.

    The power of the hop to the ego is what the ego measures of the candidate's BSMs; that of
    the sharer's hop is what the candidate announces in them. The choice is made when MoHeD
    makes it; candidates are MoHeD's of which both powers are known.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """How the powers of two hops become one figure of merit, and when that is asked for."""

        rule: Literal["sum", "min", "own"] = parameter(
            "sum",
            doc="figure of merit: the sum of both hops' powers in dBm, the smaller, or that of the "
            "hop to the ego, which the ego measures itself (3GPP TS 38.300, clause 16.12.4)",
        )
        threshold: float | None = parameter(
            None,
            unit="dBm",
            doc="candidates of which either hop is weaker are left out: the relay holds the hop "
            "from the sharer to it, the ego the other one (ibidem); null: whoever is heard is in",
        )
        hysteresis: float = parameter(
            0.0,
            unit="dB",
            minimum=0.0,
            doc="by which both hops of a new relay have to exceed `threshold`",
        )
        needs_sharer: bool = parameter(
            default=True,
            doc="whether only who announces a power of the sharer is a candidate, as a relay that "
            "does not hear it forwards no discovery; else `own` and `threshold` look at the hop "
            "to the ego alone",
        )
        reselection: Literal["window", "threshold"] = parameter(
            "window",
            doc="at each window: the strongest anew, or the current relay as long as the ego "
            "receives it at `threshold` or more strongly (ibidem)",
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._merit = _MERITS[parameters.rule]
        least = parameters.threshold
        self._least = -math.inf if least is None else least
        self._new_least = self._least + parameters.hysteresis
        self._needs_sharer = parameters.needs_sharer
        self._keeps = parameters.reselection == "threshold"

    @override
    def choose(self, situation: Situation) -> Choice:
        links, candidates = situation.known.links, np.array(list(situation.candidates), np.int64)
        from_sharer = links.power(np.array(situation.sharer.vehicle), candidates)
        to_ego = links.power(candidates, np.array(situation.ego.vehicle))
        current = NO_VEHICLE if situation.current is None else situation.current
        is_current = candidates == current
        if self._keeps and bool((to_ego[is_current] >= self._least).any()):
            return Choice(relay=current)
        least = np.where(is_current, self._least, self._new_least)
        judged = np.minimum(from_sharer, to_ego) if self._needs_sharer else to_ego
        admitted = judged >= least
        merits = np.where(admitted, self._merit(from_sharer, to_ego), np.nan).tolist()
        return Choice(relay=situation.best(dict(zip(situation.candidates, merits, strict=True))))
