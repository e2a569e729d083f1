"""The default experiment of an FMU."""

from dataclasses import dataclass
from pathlib import Path

from adapters.fmi.description import read_root


@dataclass(frozen=True, slots=True, kw_only=True)
class DefaultExperiment:
    """What an FMU says about how to run it, as it is written; `None` where it says nothing.

    Attributes:
        start, stop: [s].
        step: communication step size [s]; a fixed internal one if there is no other.
        tolerance: relative.
    """

    start: str | None = None
    stop: str | None = None
    step: str | None = None
    tolerance: str | None = None


def default_experiment(path: Path) -> DefaultExperiment:
    """Read the default experiment of the FMU at `path` (FMI 2.0.4, 2.2.5; FMI 3.0.2, 2.4.6).

    Raises:
        ComponentTypeError: it is no FMU.
    """
    root = read_root(path)
    found = root.find("DefaultExperiment")
    said = {} if found is None else found.attrib
    element = root.find("CoSimulation")
    internal = None if element is None else element.get("fixedInternalStepSize")
    return DefaultExperiment(
        start=said.get("startTime"),
        stop=said.get("stopTime"),
        step=said.get("stepSize", internal),
        tolerance=said.get("tolerance"),
    )
