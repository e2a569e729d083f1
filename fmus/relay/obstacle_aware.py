"""The base of relay policies that keep account of what stands between the radios."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.relay.inputs import Inputs
from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.surroundings import Surroundings
from orchestrator.parameters import parameter
from orchestrator.timebase import Time, nanoseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleAwareParameters(SelectionParameters):
    """Parameters of every policy that knows of obstacles."""

    same_body: float = parameter(
        1.0, unit="m", minimum=0.0, doc="distance at which two sources mean one obstacle"
    )


class ObstacleAwareSelection(RelaySelection):
    """A relay policy that knows the bodies and walls between the radios, as far as the ego does.

    What it has been told is forgotten after `lost_after`.
    """

    def __init__(self, parameters: ObstacleAwareParameters) -> None:
        super().__init__(parameters)
        self._same_body = parameters.same_body
        self._lifetime = nanoseconds(parameters.lost_after)

    @override
    def begin(self, rng: np.random.Generator) -> None:
        self._surroundings = Surroundings(self._same_body, self._lifetime)

    @override
    def remember(self, known: Inputs, now: Time) -> None:
        self._surroundings.remember(known, now)
