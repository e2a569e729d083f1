"""Measures of a run that is over, from what its manifest says."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from orchestrator.measure import Measure, measure_type
from orchestrator.parameters import declared
from orchestrator.scenario.values import convert


def measures_of(resolved: Mapping[str, Mapping[str, Any]]) -> dict[str, Measure]:
    """The measures by name.

    Args:
        resolved: `measures` of a resolved scenario; each has its `type`.

    Raises:
        ComponentTypeError: a measure is not installed, or cannot be loaded.
    """
    made = {}
    for name, entry in resolved.items():
        kind = measure_type(entry["type"])
        parameters = declared(kind)
        values = {
            key: convert(parameters[key], value, Path())
            for key, value in entry.items()
            if key != "type"
        }
        made[name] = kind(**values)
    return made
