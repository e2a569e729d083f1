"""Measures: numbers about any run, found in its recording.

A scenario names its measures; each is found by an entry point in the group
`orchestrator.measures`, whose value is a class derived from `Measure`. A `Report` is written for
one kind of scenario and draws it; a measure is one question that can be asked of many.
"""

import abc
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

from orchestrator.errors import ComponentTypeError, ParameterProblem, Problem
from orchestrator.installed import installed_class, offers
from orchestrator.parameters import REQUIRED, Parametrised, declared
from orchestrator.recording.reader import Recording
from orchestrator.signal import Connector
from orchestrator.table_files import Blocks, Table
from orchestrator.timebase import Time

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GROUP: Final = "orchestrator.measures"

Findings: TypeAlias = Mapping[str, "float | int | bool | str | None"]
"""What a measure found, by name; `None` for what cannot be said. NaN and infinities are not among
them."""

Panel: TypeAlias = "Callable[[Axes], None]"
"""Draws what was found into the axes that it is given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a measure found that is more than numbers.

    Attributes:
        numbers: by name. If one of them is `unit`, it is the unit of the others, as text.
        tables: by name. A column's name says the unit, as in `speed [km/h]`, or by its ending,
            `_m`, `_s`, `_ms`, `_ns` or `_kbit_s`; what has none is a pure number or text. Each
            table is written to `measures/MEASURE-NAME.csv`, and `.parquet`, in the run directory;
            NaN is an empty field there, and null here.
        long_tables: likewise, part by part, for what would not fit into memory.
        panel: draws it into its place on the page `measures.svg`; `None` if there is nothing to
            draw.
        panels: further ones, by what they show.
    """

    numbers: Findings
    tables: Mapping[str, Table] = field(default_factory=dict)
    long_tables: Mapping[str, Blocks] = field(default_factory=dict)
    panel: "Panel | None" = None
    panels: "Mapping[str, Panel]" = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """What a run is going to record, known before it begins.

    Attributes:
        signals: every output that is recorded, by its name `component.connector`.
        start, stop: the first and the last communication point [ns]; it may end earlier.
    """

    signals: Mapping[str, Connector]
    start: Time
    stop: Time


class Measure(Parametrised):
    """One question about a run, answered from its recording.

    A measure is a frozen dataclass; its fields, each made with `parameter`, are what a scenario may
    say under its name in `measures`. It keeps no state. The recording may have been cut short by a
    fault or an interruption; a measure says what it can, and raises `ValueError` or
    `RecordingError` with a sentence if that is nothing.

    Attributes:
        by_default: whether it is asked of runs whose scenario names no measures. Such a measure
            needs no parameters, and `signals` says what it reads.
        beside_reports: whether that is so, too, if the scenario has a report.
    """

    by_default: ClassVar[bool] = False
    beside_reports: ClassVar[bool] = True

    def signals(self) -> Sequence[str]:
        """The recorded signals that it cannot do without, `component.connector`.

        A measure that is asked by default is left out, and the run says so, where one is missing.
        """
        return ()

    def check(self, planned: Planned) -> "Iterator[ParameterProblem | Problem]":
        """Everything that shows before a run that it cannot have an answer.

        Asked of measures that a scenario names, once its components are connected.
        """
        del planned
        yield from ()

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


def defaults(*, has_report: bool = False) -> dict[str, Measure]:
    """The installed measures that are asked by default, with their defaults, by name.

    What cannot be loaded is not among them; whoever names it is told why.

    Args:
        has_report: whether the scenario has a report.
    """
    return {n: each for n, each in _defaults() if each.beside_reports or not has_report}


def _defaults() -> Iterator[tuple[str, Measure]]:
    for name in sorted(installed()):
        try:
            kind = measure_type(name)
        except ComponentTypeError:
            continue
        if kind.by_default:
            needed = [n for n, p in declared(kind).items() if p.default is REQUIRED]
            if not needed:
                yield name, kind()
