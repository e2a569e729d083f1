"""Parameter values: from what a scenario file says to what a component receives, and back."""

import json
import math
import types
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, Literal, TypeVar, Union, get_args, get_origin

from orchestrator.parameters import DRAWN, REQUIRED, Parameter
from orchestrator.scenario.diagnosis import show
from orchestrator.scenario.units import Unit, UnitError, parse_quantity, parse_unit
from orchestrator.suggestion import suggestion

_N = TypeVar("_N", int, float)


class ValueProblem(ValueError):  # noqa: N818 - one sentence, to be located by the caller
    """A value that a parameter cannot take; the message says what to write instead.

    Attributes:
        item: which item of a list is wrong, as the end of an address; empty for the value itself.
    """

    def __init__(self, what: str, item: tuple[int, ...] = ()) -> None:
        super().__init__(what)
        self.item = item


def convert(parameter: Parameter, value: Any, folder: Path) -> Any:
    """The value in the type and unit of `parameter`.

    Args:
        parameter: what the component type declares.
        value: what the scenario file says.
        folder: where relative paths start.

    Raises:
        ValueProblem: the value does not fit.
    """
    return _convert(parameter.type, parameter, value, folder)


def _convert(kind: Any, parameter: Parameter, value: Any, folder: Path) -> Any:
    origin = get_origin(kind)
    if origin is Literal:
        return _choice(get_args(kind), value)
    if origin is tuple:
        return _items(kind, parameter, value, folder)
    if origin in {Union, types.UnionType}:
        inner = [each for each in get_args(kind) if each is not types.NoneType]
        return None if value is None else _convert(inner[0], parameter, value, folder)
    if kind is Path:
        return _existing(parameter, value, folder)
    convert_scalar = _SCALARS.get(kind)
    if convert_scalar is None:
        raise ValueProblem(f"its declared type {kind} cannot be written in a scenario file")
    return convert_scalar(parameter, value)


def _choice(choices: tuple[str, ...], value: Any) -> str:
    if isinstance(value, str) and value in choices:
        return value
    text = value if isinstance(value, str) else json.dumps(value)  # `true`, `null`, 1
    hint = f"write '{text}' in quotes" if text in choices else suggestion(text, choices)
    raise ValueProblem(f"cannot be {show(value)}; {hint}")


def _items(kind: Any, parameter: Parameter, value: Any, folder: Path) -> tuple[Any, ...]:
    inner = get_args(kind)[0]
    if not isinstance(value, list):
        example = f"[{show(value)}]" if not isinstance(value, dict) else "[...]"
        raise ValueProblem(f"expected a list, got {show(value)}; write `{example}`")
    converted = []
    for index, item in enumerate(value):
        try:
            converted.append(_convert(inner, parameter, item, folder))
        except ValueProblem as problem:
            raise ValueProblem(str(problem), (index, *problem.item)) from None
    return tuple(converted)


def _existing(parameter: Parameter, value: Any, folder: Path) -> Path:
    path = (folder / _text(parameter, value)).absolute()
    try:
        found = path.exists()
    except (OSError, ValueError):  # too long, or a null byte
        found = False
    if not found:
        raise ValueProblem(f"there is no file {path} (paths are relative to the scenario file)")
    return path


def _text(parameter: Parameter, value: Any) -> str:
    del parameter
    if not isinstance(value, str):
        is_number = isinstance(value, int | float)
        hint = f"; write '{str(value).lower()}' in quotes" if is_number else ""
        raise ValueProblem(f"expected text, got {show(value)}{hint}")
    return value


def _truth(parameter: Parameter, value: Any) -> bool:
    del parameter
    if not isinstance(value, bool):
        raise ValueProblem(f"expected `true` or `false`, got {show(value)}")
    return value


def _whole(parameter: Parameter, value: Any) -> int:
    exact = _number(parameter, value, "a whole number")
    if exact.denominator != 1:
        raise ValueProblem(f"expected a whole number{_in_unit(parameter)}, got {show(value)}")
    return _bounded(parameter, int(exact), value)


def _real(parameter: Parameter, value: Any) -> float:
    try:
        number = float(_number(parameter, value, "a number"))
    except OverflowError:
        raise ValueProblem(f"{show(value)} is too large") from None
    return _bounded(parameter, number, value)


def _number(parameter: Parameter, value: Any, expected: str) -> Fraction:
    """The exact number in the unit of `parameter`."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise ValueProblem(f"must be finite, got {value}")
        return Fraction(value)
    unit = parse_unit(parameter.unit)
    if not isinstance(value, str):
        raise ValueProblem(f"expected {expected}{_in_unit(parameter)}, got {show(value)}")
    try:
        quantity = parse_quantity(value)
        if quantity.unit.symbol == "1" and unit.symbol != "1":
            raise ValueProblem(f"{show(value)} has no unit; write `{value.strip()} {unit.symbol}`")
        return quantity.into(unit)
    except UnitError as error:
        raise ValueProblem(f"{show(value)}: {error}{_example(parameter, unit)}") from None


def _example(parameter: Parameter, unit: Unit) -> str:
    """What to write instead, when the default says it well."""
    default = parameter.default
    if unit.symbol == "1" or default in (REQUIRED, DRAWN) or isinstance(default, tuple):
        return ""
    return f"; for example `{default:g} {unit.symbol}`"


def _in_unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f" in {parameter.unit}"


def _bounded(parameter: Parameter, number: _N, value: Any) -> _N:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    is_converted = isinstance(value, str) and not value.endswith(unit or " ")
    written = f" ({show(value)})" if is_converted else ""
    if parameter.minimum is not None and number < parameter.minimum:
        raise ValueProblem(
            f"must be at least {parameter.minimum:g}{unit}, got {number:g}{unit}{written}"
        )
    if parameter.maximum is not None and number > parameter.maximum:
        raise ValueProblem(
            f"must be at most {parameter.maximum:g}{unit}, got {number:g}{unit}{written}"
        )
    return number


_SCALARS: Final[Mapping[Any, Callable[[Parameter, Any], Any]]] = {
    bool: _truth,
    int: _whole,
    float: _real,
    str: _text,
}


def written(parameter: Parameter, value: Any) -> Any:
    """`value` as a scenario file would say it: what `convert` turns into `value` again."""
    if isinstance(value, tuple):
        return [written(parameter, item) for item in value]
    if isinstance(value, Path):
        return str(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value!r} {parameter.unit}" if is_number and parameter.unit != "1" else value


def kind_name(kind: Any) -> str:
    """The type of a parameter, for people."""
    origin = get_origin(kind)
    if origin is Literal:
        return " | ".join(map(str, get_args(kind)))
    if origin is tuple:
        return f"list of {kind_name(get_args(kind)[0])}"
    if origin in {Union, types.UnionType}:
        return " or ".join("null" if k is types.NoneType else kind_name(k) for k in get_args(kind))
    return {
        bool: "true | false",
        int: "whole number",
        float: "number",
        str: "text",
        Path: "path",
    }.get(kind, str(kind))
