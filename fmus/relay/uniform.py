"""Random relay selection, a rival in the paper's Table II."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.situation import Choice, Situation
from orchestrator.parameters import parameter


class Random(RelaySelection):
    """A relay drawn at random: every candidate is equally likely, at every choice.

    The choice is made when MoHeD makes it, among the same candidates.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """Who takes part in the draw."""

        direct_link: bool = parameter(
            default=False, doc="whether the direct link is drawn as if it were one more relay"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._always = [NO_VEHICLE] if parameters.direct_link else []

    @override
    def begin(self, rng: np.random.Generator) -> None:
        self._rng = rng

    @override
    def choose(self, situation: Situation) -> Choice:
        drawn_from = [*self._always, *situation.candidates] or [NO_VEHICLE]
        return Choice(relay=drawn_from[int(self._rng.integers(len(drawn_from)))])
