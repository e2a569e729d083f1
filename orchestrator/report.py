"""Reports: from a recording to metrics, a summary and a figure.

A scenario names its report, alone or with parameters; it is found by an entry point in the group
`orchestrator.reports`, whose value is a class derived from `Report`.
"""

import abc
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import ParameterProblem
from orchestrator.installed import installed_class, offers
from orchestrator.parameters import Parametrised
from orchestrator.recording.reader import Recording

GROUP: Final = "orchestrator.reports"


class Report(Parametrised):
    """What the recording of a scenario says, in numbers and in one figure.

    A report is a frozen dataclass; its fields, each made with `parameter`, are what a scenario may
    say as its parameters. One without any need not be a dataclass. It has no state. The recording
    may have been cut short by a fault or an interruption, or lack a signal that the scenario
    excludes; a report says what it can, and raises `ValueError` or `RecordingError` with a sentence
    if that is nothing.
    """

    def problems_with(
        self, components: Mapping[str, Mapping[str, Any]]
    ) -> Iterator[ParameterProblem]:
        """Everything wrong with the parameters in a system whose components have these.

        Args:
            components: the parameters of each with which nothing is wrong, by names.
        """
        del components
        yield from ()

    @abc.abstractmethod
    def metrics(self, recording: Recording) -> Mapping[str, Any]:
        """The metrics of the run, by name: numbers, booleans, text, `None`, or more of these.

        They go into `metrics.json`, so NaN and infinities are not among them.
        """

    @abc.abstractmethod
    def summary(self, metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
        """A few lines for the terminal.

        Args:
            metrics: as `metrics` returned them, or as read from `metrics.json`.
            manifest: the contents of `manifest.json`.
        """

    @abc.abstractmethod
    def figure(self, recording: Recording, metrics: Mapping[str, Any], path: Path) -> None:
        """Draw the run into a PNG file at `path`."""


def installed() -> Mapping[str, str]:
    """The reports that packages offer: by name, where each comes from."""
    return offers(GROUP)


def report_type(name: str) -> type[Report]:
    """Load the report called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    return installed_class(GROUP, name, Report, "report")  # type: ignore[type-abstract]
