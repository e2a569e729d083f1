"""What a host was asked since its last checkpoint, so that another one can take its place."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from orchestrator.course import Course
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time

CHECKPOINT: Final = 100
"""Steps between two checkpoints: what is made again at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A step of a component.

    Attributes:
        inputs: by name, at its start.
        t: where it starts [ns].
        h: its length [ns].
        courses: of the inputs that change during the step.
    """

    inputs: Signals
    t: Time
    h: Duration
    courses: Mapping[str, Course]


@dataclass(slots=True)
class Journal:
    """How a component came to where it is.

    Attributes:
        start: of the run [ns].
        document: of the command that set it up.
        initial: its inputs at the start; `None` before it is initialised.
        state: at the last checkpoint; `None` if there was none.
        steps: that it has made since.
        current: the step that it works on, if it works on one.
        again: the step for which a host was started again, last.
    """

    start: Time = 0
    document: Mapping[str, Any] = field(default_factory=dict)
    initial: Signals | None = None
    state: bytes | None = None
    steps: list[Step] = field(default_factory=list)
    current: Step | None = None
    again: Step | None = None

    @property
    def is_due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return len(self.steps) >= CHECKPOINT

    def keep(self, state: bytes) -> None:
        """Begin anew from a state."""
        self.state = state
        self.steps.clear()

    def finish(self) -> None:
        """Note that the current step is made."""
        if self.current is not None:
            self.steps.append(self.current)
            self.current = None
