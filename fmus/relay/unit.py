"""What every relay unit has: its connectors, and the course of its choices."""

import numpy as np
from typing_extensions import override

from fmus.relay.connectors import CONNECTORS
from fmus.relay.course import Course
from orchestrator.component import Component
from orchestrator.signal import Signals
from orchestrator.timebase import Time


class RelayUnit(Component):
    """Takes in what the ego knows and gives out the choice in force; `step` makes the choices.

    At the start the choice is the direct link, for nobody.
    """

    connectors = CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._course = Course()

    @override
    def outputs(self) -> Signals:
        return self._course.outputs
