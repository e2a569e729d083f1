"""Paths among what a scenario gives to components, measures and its report, and where each stands.

Where a run is repeated on another machine, the files are elsewhere.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.scenario.absent import AbsentType
from orchestrator.scenario.document import Address
from orchestrator.scenario.model import ComponentUse, Scenario


@dataclass(frozen=True, slots=True)
class PathValue:
    """A path that a scenario gives to somebody.

    Attributes:
        reader: a component, or `measures.NAME`, or `report`.
        at: its address in the resolved scenario.
        path: as the reader gets it.
        rest: what stands behind it there, such as the class in a file, `:Wheel`.
    """

    reader: str
    at: Address
    path: Path
    rest: str = ""


def path_values(scenario: Scenario) -> Iterator[PathValue]:
    """Every path in `Scenario.resolved`, in the order of components, measures and report."""
    for name, use in scenario.components.items():
        yield from _of_component(name, use)
    for name, values in plug_in_values(scenario).items():
        if name == "report":
            top: Address = ("report", "parameters")
        else:
            top = ("measures", name.removeprefix("measures."))
        yield from _within(name, top, values)


def plug_in_values(scenario: Scenario) -> Mapping[str, Mapping[str, Any]]:
    """The parameters of measures and of the report, as `measures.NAME` and `report`."""
    measures = scenario.measures or {}
    found = {f"measures.{name}": use.values for name, use in measures.items()}
    return found if scenario.report is None else {**found, "report": scenario.report.values}


def _of_component(name: str, use: ComponentUse) -> Iterator[PathValue]:
    top: Address = ("components", name)
    if use.fmu is not None:
        yield PathValue(name, (*top, "fmu"), use.fmu)
    if use.module is not None and use.type_name is not None:
        rest = f":{use.type_name.rpartition(':')[2]}"
        yield PathValue(name, (*top, "type"), use.module, rest)
    if not isinstance(use.type, AbsentType):
        yield from _within(name, (*top, "parameters"), use.all_values())


def _within(reader: str, at: Address, value: Any) -> Iterator[PathValue]:
    """The paths in a value, wherever `written` puts them."""
    match value:
        case Path():
            yield PathValue(reader, at, value)
        case Mapping():
            for key, each in value.items():
                yield from _within(reader, (*at, str(key)), each)
        case tuple():
            for k, each in enumerate(value):
                yield from _within(reader, (*at, k), each)
        case _ if dataclasses.is_dataclass(value):
            for field in dataclasses.fields(value):
                yield from _within(reader, (*at, field.name), getattr(value, field.name))
