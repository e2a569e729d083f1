"""What an FMU says about a step that it was asked for, version by version the same."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class StepOutcome:
    """What came of one call of `fmi2DoStep` or `fmi3DoStep` that did not fail.

    Attributes:
        time: how far the FMU came [s]; `None`: to the end of the step.
        is_discarded: the step was not made; the FMU may have come as far as `time`.
        is_early: FMI 3.0: it returned at `time`, ready to go on from there.
        wants_end: the FMU asks to end the simulation.
        needs_event: FMI 3.0: events are to be handled before the next step.
    """

    time: float | None = None
    is_discarded: bool = False
    is_early: bool = False
    wants_end: bool = False
    needs_event: bool = False


MADE: Final = StepOutcome()
"""The step was made to its end, and there is nothing else to say."""
