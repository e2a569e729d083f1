"""The single numbers that components tell over time, which viewers plot."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from orchestrator.recording.declared import declared_shape, element_type
from orchestrator.recording.reader import Recording, Series
from orchestrator.recording.tidy import MOST_COLUMNS

_OWN: Final = "value"
"""What the number `a` is called in the group `a`, where there is `a.b`, too."""

_TYPES: Final = {"b": "boolean", "i": "integer", "u": "integer"}
"""What JSON Schema calls types of elements, by their first letters; others are numbers."""


def numbers_of(recording: Recording) -> dict[str, list[str]]:
    """Signals of constant shape that are few numbers, by component."""
    found: dict[str, list[str]] = {}
    for name in recording.signals:
        shape = declared_shape(recording.kind(name))
        if shape is None or recording.is_fixed(name):
            continue
        lengths = [n for n in shape if isinstance(n, int)]
        if len(lengths) == len(shape) and math.prod(lengths) <= MOST_COLUMNS:
            found.setdefault(name.partition(".")[0], []).append(name)
    return found


def nested(told: Mapping[str, Any]) -> dict[str, Any]:
    """Values by names with dots as groups of groups: viewers take a dot for a step inwards."""
    tree: dict[str, Any] = {}
    for name, value in told.items():
        *groups, last = name.split(".")
        if any(other.startswith(f"{name}.") for other in told):
            groups, last = [*groups, last], _OWN
        here = tree
        for group in groups:
            here = here.setdefault(group, {})
        here[last] = value
    return tree


def schema_of(component: str, series: Sequence[Series]) -> dict[str, Any]:
    """The JSON Schema of what a component tells, with units as descriptions."""
    leaves = {each.name.partition(".")[2]: each for each in series}
    return {"title": component, **_schema_of(nested(leaves))}


def _schema_of(branch: dict[str, Any] | Series) -> dict[str, Any]:
    if isinstance(branch, dict):
        properties = {name: _schema_of(each) for name, each in branch.items()}
        return {"type": "object", "properties": properties}
    element = element_type(branch.kind) or ""
    schema: dict[str, Any] = {"type": _TYPES.get(element[:1], "number"), "description": branch.unit}
    for _ in declared_shape(branch.kind) or ():
        schema = {"type": "array", "items": schema}
    return schema
