"""Parameters for people and for programs, with the records that they are made of."""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from orchestrator.distribution import Constant
from orchestrator.kinds import record_in
from orchestrator.parameters import DRAWN, REQUIRED, Parameter, declared, description
from orchestrator.scenario.kind_names import kind_name
from orchestrator.scenario.values import written


def parameter_rows(parameters: Mapping[str, Parameter]) -> list[tuple[str, ...]]:
    """One row per parameter; those of a record are indented, where it is named first."""
    return _rows(parameters, "", set())


def parameter_data(
    parameters: Mapping[str, Parameter], above: tuple[type, ...] = ()
) -> dict[str, Any]:
    """What is known of each parameter, for `--json`.

    Args:
        parameters: by name.
        above: records around them, which are not described again.
    """
    return {name: _data(parameter, above) for name, parameter in parameters.items()}


def _rows(
    parameters: Mapping[str, Parameter], indent: str, shown: set[type]
) -> list[tuple[str, ...]]:
    rows = []
    for name, parameter in parameters.items():
        rows.append((indent + name, *_cells(parameter)))
        record = record_in(parameter.type)
        if record is None or record in shown:
            continue
        shown.add(record)
        inner = f"{indent}  "
        rows.append((f"{inner}{record.__name__}:", "", "", "", description(record)))
        rows += _rows(declared(record), f"{inner}  ", shown)
    return rows


def _cells(parameter: Parameter) -> tuple[str, ...]:
    default = "required"
    if parameter.default is DRAWN:
        default = "= drawn"
    elif parameter.default is not REQUIRED:
        default = f"= {_default(parameter)}"
    unit = "" if parameter.unit == "1" else parameter.unit
    return kind_name(parameter.type), default, _bounds(parameter, unit), _doc(parameter)


def _doc(parameter: Parameter) -> str:
    """What the parameter says of itself, with the names that it knows."""
    names = [name for name in _names(parameter) or () if name]
    return f"{parameter.doc} ({', '.join(names)})" if names else parameter.doc


def _names(parameter: Parameter) -> list[str] | None:
    return None if parameter.names is None else list(parameter.names())


def _bounds(parameter: Parameter, unit: str) -> str:
    default = parameter.default
    shown = "" if isinstance(default, int | float | Constant | tuple) and default != () else unit
    match parameter.minimum, parameter.maximum:
        case None, None:
            return shown
        case low, None:
            return f">= {low:g} {shown}".rstrip()
        case None, high:
            return f"<= {high:g} {shown}".rstrip()
        case low, high:
            return f"{low:g} .. {high:g} {shown}".rstrip()


def _default(parameter: Parameter) -> str:
    default = parameter.default
    match default:
        case float(number) | Constant(number):
            return f"{number:.9g}{'' if parameter.unit == '1' else ' ' + parameter.unit}"
        case _ if dataclasses.is_dataclass(default):
            return "as below" if _is_all_default(default) else _flow(written(parameter, default))
        case _:
            value = written(parameter, default)
            return value if isinstance(value, str) else json.dumps(value)


def _is_all_default(record: Any) -> bool:
    """Whether a record says what it would if nothing were given."""
    return all(getattr(record, f.name) == f.default for f in dataclasses.fields(record))


def _flow(value: Any) -> str:
    """Plain data in the flow style of YAML."""
    match value:
        case dict():
            return f"{{{', '.join(f'{key}: {_flow(each)}' for key, each in value.items())}}}"
        case list():
            return f"[{', '.join(map(_flow, value))}]"
        case str():
            return value
        case _:
            return json.dumps(value)


def _data(parameter: Parameter, above: tuple[type, ...]) -> dict[str, Any]:
    has_default = parameter.default not in (REQUIRED, DRAWN)
    data = {
        "type": kind_name(parameter.type),
        "unit": parameter.unit,
        "required": parameter.default is REQUIRED,
        "default": written(parameter, parameter.default) if has_default else None,
        "minimum": parameter.minimum,
        "maximum": parameter.maximum,
        "names": _names(parameter),
        "doc": parameter.doc,
    }
    record = record_in(parameter.type)
    if record is None:
        return data
    inner = None if record in above else parameter_data(declared(record), (*above, record))
    described = {"name": record.__name__, "description": description(record), "parameters": inner}
    return {**data, "record": described}
