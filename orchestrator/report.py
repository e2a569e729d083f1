"""Reports: from a recording to metrics, a summary and a figure.

A scenario names its report; it is found by an entry point in the group
`orchestrator.reports`, whose value is a class derived from `Report`.
"""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from orchestrator.errors import ComponentTypeError
from orchestrator.installed import entry_points
from orchestrator.recording.reader import Recording
from orchestrator.suggestion import suggestion

GROUP: Final = "orchestrator.reports"

_Base = TypeVar("_Base")


class Report(abc.ABC):
    """What the recording of a scenario says, in numbers and in one figure.

    A report is created without arguments and has no state. The recording may have been cut
    short by a fault or an interruption, or lack a signal that the scenario excludes; a report says
    what it can, and raises `ValueError` or `RecordingError` with a sentence if that is nothing.
    """

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


def report_type(name: str) -> type[Report]:
    """Load the report called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    return installed_class(GROUP, name, Report, "report")  # type: ignore[type-abstract]


def installed_class(group: str, name: str, base: type[_Base], noun: str) -> type[_Base]:
    """Load the class that an installed package offers as `name`.

    Args:
        group: of entry points.
        name: of the entry point.
        base: what the class must be derived from.
        noun: what messages call it.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    offers = {entry.name: entry for entry in entry_points(group=group)}
    if name not in offers:
        raise ComponentTypeError(f"no {noun} `{name}` is installed; {suggestion(name, offers)}")
    try:
        found = offers[name].load()
    except Exception as error:  # whatever a plug-in does when it is imported
        reason = f"{type(error).__name__}: {error}"
        raise ComponentTypeError(f"the {noun} `{name}` cannot be loaded: {reason}") from error
    if not (isinstance(found, type) and issubclass(found, base)):
        what = f"the {noun} `{name}` is not a class derived from `{base.__name__}`"
        raise ComponentTypeError(what)
    return found
