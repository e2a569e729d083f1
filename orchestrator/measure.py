"""Measures: numbers about any run, found in its recording.

A scenario names its measures; each is found by an entry point in the group
`orchestrator.measures`, whose value is a class derived from `Measure`. A `Report` is written for
one kind of scenario and draws it; a measure is one question that can be asked of many.
"""

import abc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

from orchestrator.installed import installed_class, offers
from orchestrator.parameters import Parametrised
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GROUP: Final = "orchestrator.measures"

Findings: TypeAlias = Mapping[str, "float | int | bool | str | None"]
"""What a measure found, by name; `None` for what cannot be said. NaN and infinities are not among
them."""

Table: TypeAlias = Mapping[str, Array]
"""Columns by name, each of shape (row,)."""

Panel: TypeAlias = "Callable[[Axes], None]"
"""Draws what was found into the axes that it is given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a measure found that is more than numbers.

    Attributes:
        numbers: by name.
        tables: by name; each is written to `measures/MEASURE-NAME.csv` in the run directory, with
            empty fields for NaN.
        panel: draws it into its place in `measures.png`; `None` if there is nothing to draw.
    """

    numbers: Findings
    tables: Mapping[str, Table] = field(default_factory=dict)
    panel: "Panel | None" = None


class Measure(Parametrised):
    """One question about a run, answered from its recording.

    A measure is a frozen dataclass; its fields, each made with `parameter`, are what a scenario may
    say under its name in `measures`. It keeps no state. The recording may have been cut short by a
    fault or an interruption; a measure says what it can, and raises `ValueError` or
    `RecordingError` with a sentence if that is nothing.
    """

    @abc.abstractmethod
    def compute(self, recording: Recording) -> Findings | Answer:
        """The answer, in numbers, or with tables and a panel, too.

        The numbers stand in `metrics.json` under `measures`, under the name that the scenario uses,
        and experiments name them `measures.NAME.KEY`.
        """


def installed() -> Mapping[str, str]:
    """The measures that packages offer: by name, where each comes from."""
    return offers(GROUP)


def measure_type(name: str) -> type[Measure]:
    """Load the measure called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    return installed_class(GROUP, name, Measure, "measure")  # type: ignore[type-abstract]
