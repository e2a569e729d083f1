"""How a run ended: what came of it, or what ended it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from orchestrator.early_end import EarlyEnd
from orchestrator.errors import CosimError
from orchestrator.observer import WallTime


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOutcome:
    """A run that came to its end.

    Attributes:
        directory: of the run.
        fingerprint: of everything that was recorded.
        simulated: simulated time [s].
        wall_time: where the time of the simulation went.
        speed: simulated seconds per second of wall time.
        metrics: of the scenario's report; empty without one.
        summary: the report's lines for the terminal; empty without one.
        recorded: what each recorded signal takes on disk [byte], largest first.
        early_end: why it ended before its stop time; `None` if it did not.
        coupling: what the coupling algorithm counted; empty if it counts nothing.
        page: `index.html`, if it was wanted.
        cautions: what the scenario chooses that biases its results, as sentences.
    """

    directory: Path
    fingerprint: str
    simulated: float
    wall_time: WallTime
    speed: float
    metrics: Mapping[str, Any]
    summary: str
    recorded: Mapping[str, int]
    early_end: EarlyEnd | None = None
    coupling: Mapping[str, int] = field(default_factory=dict)
    page: Path | None = None
    cautions: tuple[str, ...] = ()


class RunFailedError(CosimError):
    """A run ended early; the cause is chained.

    Attributes:
        directory: what was recorded until then can be read there.
    """

    def __init__(self, message: str, directory: Path) -> None:
        super().__init__(message)
        self.directory = directory


class ReportFailedError(RunFailedError):
    """The run is complete; its report, a measure or the page is at fault. The cause is chained."""


class RunInterrupted(KeyboardInterrupt):
    """A run was interrupted from outside.

    Attributes:
        directory: what was recorded until then can be read there.
    """

    def __init__(self, directory: Path) -> None:
        super().__init__("interrupted")
        self.directory = directory
