"""Measures: numbers about any run, found in its recording.

A scenario names its measures; each is found by an entry point in the group
`orchestrator.measures`, whose value is a class derived from `Measure`. A `Report` is written for
one kind of scenario and draws it; a measure is one question that can be asked of many.
"""

import abc
from collections.abc import Mapping
from typing import Final, TypeAlias

from orchestrator.installed import installed_class, offers
from orchestrator.parameters import Parametrised
from orchestrator.recording.reader import Recording

GROUP: Final = "orchestrator.measures"

Findings: TypeAlias = Mapping[str, "float | int | bool | str | None"]
"""What a measure found, by name; `None` for what cannot be said. NaN and infinities are not among
them."""


class Measure(Parametrised):
    """One question about a run, answered from its recording.

    A measure is a frozen dataclass; its fields, each made with `parameter`, are what a scenario may
    say under its name in `measures`. It keeps no state. The recording may have been cut short by a
    fault or an interruption; a measure says what it can, and raises `ValueError` or
    `RecordingError` with a sentence if that is nothing.
    """

    @abc.abstractmethod
    def compute(self, recording: Recording) -> Findings:
        """The answer, in numbers.

        They stand in `metrics.json` under `measures`, under the name that the scenario uses, and
        experiments name them `measures.NAME.KEY`.
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
