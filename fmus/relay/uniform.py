"""Random relay selection, a rival in the paper's Table II."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.policy import Choice, Policy, Situation
from fmus.relay.selection import RelaySelection, SelectionParameters
from orchestrator.parameters import parameter
from orchestrator.signal import Signals


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
        self._parameters = parameters

    @override
    def _policy(self, rng: np.random.Generator) -> Policy:
        return UniformDraw(rng, direct_link=self._parameters.direct_link)


class UniformDraw(Policy):
    """Draws a candidate, where there is one.

    Args:
        rng: the component's own stream.
        direct_link: whether the direct link takes part.
    """

    def __init__(self, rng: np.random.Generator, *, direct_link: bool) -> None:
        self._rng = rng
        self._always = [NO_VEHICLE] if direct_link else []

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        drawn_from = [*self._always, *situation.candidates] or [NO_VEHICLE]
        return Choice(relay=drawn_from[int(self._rng.integers(len(drawn_from)))])
