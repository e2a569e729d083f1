"""The JSON Schema (draft 2020-12) of the values of parameters, as scenario files write them."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

from orchestrator.distribution import DistributedText, Distribution
from orchestrator.kinds import FILE_OR_NAME, Leaf, Listed, Named, Optional, Record, kind_of
from orchestrator.parameters import DRAWN, REQUIRED, Parameter, declared, description
from orchestrator.scenario.conversion import DISTRIBUTIONS, NAME
from orchestrator.scenario.units import difference
from orchestrator.scenario.values import written
from orchestrator.units import NUMBER

Schema = dict[str, Any]

_UNIT: Final = r"\s*[A-Za-zµμ°%1][A-Za-z0-9µμ°%.*^/() -]*"
_TEXT: Final[Schema] = {"type": "string"}


class ParameterSchemas:
    """Makes schemas of parameters; a record is described once, among the definitions.

    Args:
        is_whole: whether required parameters are asked for. A file that extends another one need
            not repeat them.

    Attributes:
        definitions: of the records met so far, for `$defs`.
    """

    def __init__(self, *, is_whole: bool) -> None:
        self._is_whole = is_whole
        self.definitions: dict[str, Schema] = {}

    def parameters(self, declared: Mapping[str, Parameter]) -> Schema:
        """The schema of a mapping with these parameters and no others."""
        required = [name for name, p in declared.items() if p.default is REQUIRED]
        return {
            "type": "object",
            "properties": {name: self.parameter(p) for name, p in declared.items()},
            "additionalProperties": False,
            **({"required": required} if required and self._is_whole else {}),
        }

    def parameter(self, parameter: Parameter) -> Schema:
        """The schema of a parameter, with its description, its unit and its default."""
        unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
        schema = {"description": f"{parameter.doc}{unit}", **self._value(parameter.type, parameter)}
        if parameter.default in (REQUIRED, DRAWN):
            return schema
        return {**schema, "default": written(parameter, parameter.default)}

    def _value(self, annotation: Any, parameter: Parameter) -> Schema:
        match kind_of(annotation):
            case Optional(inner):
                return {"anyOf": [self._value(inner, parameter), {"type": "null"}]}
            case Listed(item):
                return {"type": "array", "items": self._value(item, parameter)}
            case Named(inner):
                return {
                    "type": "object",
                    "propertyNames": {
                        "pattern": f"^{NAME.pattern}$",
                        "not": {"enum": list(DISTRIBUTIONS)},
                    },
                    "additionalProperties": self._value(inner, parameter),
                }
            case Record(record):
                return {"$ref": f"#/$defs/{self._defined(record)}"}
            case Leaf(kind):
                return _leaf(kind, parameter)

    def _defined(self, record: type) -> str:
        """The name of the definition of a record."""
        form = "" if self._is_whole else ".part"
        name = re.sub(r"[^A-Za-z0-9._]", "_", f"{record.__module__}.{record.__qualname__}{form}")
        if name not in self.definitions:
            self.definitions[name] = {}  # a record may contain itself
            self.definitions[name] = {
                "description": description(record),
                **self.parameters(declared(record)),
            }
        return name


def _leaf(kind: Any, parameter: Parameter) -> Schema:
    if get_origin(kind) is Literal:
        return {"enum": list(get_args(kind))}
    if kind is bool:
        return {"type": "boolean"}
    if kind in {int, float}:
        return _number(kind, parameter)
    if kind is Distribution:
        return _distribution(parameter)
    if kind is DistributedText:
        return {"anyOf": [_TEXT, _keyed("choice", _choice(_TEXT))]}
    return _text(parameter) if kind in {str, Path, FILE_OR_NAME} else {}


def _text(parameter: Parameter) -> Schema:
    """Text, with the names that are known for editors to offer."""
    if parameter.names is None:
        return _TEXT
    return {"anyOf": [{"enum": list(parameter.names())}, _TEXT]}


def _number(kind: type, parameter: Parameter) -> Schema:
    bounds = {"minimum": parameter.minimum, "maximum": parameter.maximum}
    number = {
        "type": "integer" if kind is int else "number",
        **{key: bound for key, bound in bounds.items() if bound is not None},
    }
    unit = _UNIT if parameter.unit != "1" else f"({_UNIT})?"
    quantity = {"type": "string", "pattern": rf"^\s*{NUMBER}{unit}\s*$"}
    return {"anyOf": [number, quantity]}


def _distribution(parameter: Parameter) -> Schema:
    number = _number(float, parameter)
    unbounded = Parameter(type=float, unit=difference(parameter.unit), default=REQUIRED)
    normal = {"mean": number, "deviation": _number(float, unbounded), "low": number, "high": number}
    forms = {
        "uniform": {"type": "array", "items": number, "minItems": 2, "maxItems": 2},
        "normal": {**_object(normal), "required": ["mean", "deviation"]},
        "choice": _choice(number),
    }
    return {"anyOf": [*number["anyOf"], *(_keyed(word, form) for word, form in forms.items())]}


def _choice(value: Schema) -> Schema:
    values = {"type": "array", "items": value, "minItems": 1}
    weights = {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}}
    weighted = {**_object({"values": values, "weights": weights}), "required": ["values"]}
    return {"anyOf": [values, weighted]}


def _keyed(word: str, schema: Schema) -> Schema:
    return {**_object({word: schema}), "required": [word]}


def _object(properties: Schema) -> Schema:
    return {"type": "object", "properties": properties, "additionalProperties": False}
