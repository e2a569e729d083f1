"""The types of parameters, for people."""

from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

from orchestrator.distribution import DistributedText, Distribution
from orchestrator.kinds import FILE_OR_NAME, Leaf, Listed, Named, Optional, Record, kind_of
from orchestrator.parameters import Parameter

_NAMES: Final = {
    bool: "true | false",
    int: "whole number",
    float: "number",
    str: "text",
    Path: "path",
    FILE_OR_NAME: "name or path",
    Distribution: "number or distribution",
    DistributedText: "text or choice",
}


def kind_name(annotation: Any) -> str:
    """The type of a parameter; a record by its name."""
    match kind_of(annotation):
        case Optional(inner):
            return f"{kind_name(inner)} or null"
        case Listed(item):
            return f"list of {kind_name(item)}"
        case Named(inner):
            return f"{kind_name(inner)}, by name"
        case Record(record):
            return record.__name__
        case Leaf(kind) if get_origin(kind) is Literal:
            return " | ".join(map(str, get_args(kind)))
        case Leaf(kind):
            return _NAMES.get(kind, str(kind))


def missing(name: str, parameter: Parameter) -> str:
    """The sentence about a required parameter that a file does not give."""
    unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
    return f"the parameter `{name}` is missing: {kind_name(parameter.type)}{unit}, {parameter.doc}"
