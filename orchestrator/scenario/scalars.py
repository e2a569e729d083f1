"""Parameter values without structure: numbers with units, text, choices and paths."""

import json
import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, Literal, TypeVar, get_args, get_origin

from orchestrator.kinds import FILE_OR_NAME
from orchestrator.parameters import Parameter
from orchestrator.regular_files import endless
from orchestrator.scenario.diagnosis import show
from orchestrator.suggestion import suggestion
from orchestrator.units import NoUnitError, UnitError, number_in

_N = TypeVar("_N", int, float)

_LEAST: Final = -(1 << 63)
_MOST: Final = (1 << 64) - 1
"""Whole numbers are those that 64 bits hold, with a sign or without."""

NO_FILE: Final = "there is no file"
"""How the message about a path that leads nowhere begins."""


class ScalarProblem(ValueError):  # noqa: N818 - one sentence, to be located by the caller
    """A value that a parameter cannot take; the message says what to write instead."""


def convert_scalar(kind: Any, parameter: Parameter, value: Any, folder: Path) -> Any:
    """The value in the type `kind` and the unit of `parameter`.

    Args:
        kind: a type without structure.
        parameter: whose unit and bounds hold.
        value: what the scenario file says.
        folder: where relative paths start.

    Raises:
        ScalarProblem: the value does not fit.
    """
    if get_origin(kind) is Literal:
        return _choice(get_args(kind), value)
    if kind is Path:
        return _existing(parameter, value, folder)
    if kind == FILE_OR_NAME:
        return _file_or_name(parameter, value, folder)
    convert = _SCALARS.get(kind)
    if convert is None:
        raise ScalarProblem(f"its declared type {kind} cannot be written in a scenario file")
    return convert(parameter, value)


def _choice(choices: tuple[str, ...], value: Any) -> str:
    if isinstance(value, str) and value in choices:
        return value
    text = value if isinstance(value, str) else json.dumps(value)  # `true`, `null`, 1
    hint = f"write '{text}' in quotes" if text in choices else suggestion(text, choices)
    raise ScalarProblem(f"cannot be {show(value)}; {hint}")


def _existing(parameter: Parameter, value: Any, folder: Path) -> Path:
    path = (folder / _text(parameter, value)).absolute()
    try:
        kind = endless(path)
    except (OSError, ValueError):  # there is none; the path is too long, or has a null byte
        what = f"{NO_FILE} {path} (paths are relative to the scenario file)"
        raise ScalarProblem(what) from None
    if kind:
        raise ScalarProblem(f"{path} is {kind}, not a file")
    return path


def _file_or_name(parameter: Parameter, value: Any, folder: Path) -> str | Path:
    text = _text(parameter, value)
    path = Path(text)
    if path.name != text or path.suffix:
        return _existing(parameter, value, folder)
    names = None if parameter.names is None else parameter.names()
    if names is not None and text not in names:
        what = f"there is no `{text}`, and a path has a folder or a suffix"
        raise ScalarProblem(f"{what}; {suggestion(text, filter(None, names))}")
    return text


def _text(parameter: Parameter, value: Any) -> str:
    del parameter
    if not isinstance(value, str):
        is_number = isinstance(value, int | float)
        hint = f"; write '{str(value).lower()}' in quotes" if is_number else ""
        raise ScalarProblem(f"expected text, got {show(value)}{hint}")
    return value


def _truth(parameter: Parameter, value: Any) -> bool:
    del parameter
    if not isinstance(value, bool):
        raise ScalarProblem(f"expected `true` or `false`, got {show(value)}")
    return value


def _whole(parameter: Parameter, value: Any) -> int:
    exact = _number(parameter, value, "a whole number")
    if exact.denominator != 1:
        raise ScalarProblem(f"expected a whole number{_in_unit(parameter)}, got {show(value)}")
    number = int(exact)
    if not _LEAST <= number <= _MOST:
        raise ScalarProblem(f"{show(value)} is too large")
    return _bounded(parameter, number, value)


def _real(parameter: Parameter, value: Any) -> float:
    try:
        number = float(_number(parameter, value, "a number"))
    except OverflowError:
        raise ScalarProblem(f"{show(value)} is too large") from None
    return _bounded(parameter, number, value)


def _number(parameter: Parameter, value: Any, expected: str) -> Fraction:
    """The exact number in the unit of `parameter`."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        if isinstance(value, float) and not math.isfinite(value):
            raise ScalarProblem(f"must be finite, got {value}")
        return Fraction(value)
    if not isinstance(value, str):
        raise ScalarProblem(f"expected {expected}{_in_unit(parameter)}, got {show(value)}")
    unit, definition = parameter.unit, parameter.definition
    try:
        return number_in(value, unit, definition, is_difference=parameter.is_relative)
    except NoUnitError as error:
        raise ScalarProblem(f"{show(value)} {error}") from None
    except UnitError as error:
        raise ScalarProblem(f"{show(value)}: {error}{_example(parameter)}") from None


def _example(parameter: Parameter) -> str:
    """What to write instead, when the default says it well."""
    default = parameter.default
    if parameter.unit == "1" or not isinstance(default, int | float):
        return ""
    return f"; for example `{default:g} {parameter.unit}`"


def _in_unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f" in {parameter.unit}"


def _bounded(parameter: Parameter, number: _N, value: Any) -> _N:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    is_converted = isinstance(value, str) and not value.endswith(unit or " ")
    written = f" ({show(value)})" if is_converted else ""
    if parameter.minimum is not None and number < parameter.minimum:
        raise ScalarProblem(
            f"must be at least {parameter.minimum:g}{unit}, got {number:g}{unit}{written}"
        )
    if parameter.maximum is not None and number > parameter.maximum:
        raise ScalarProblem(
            f"must be at most {parameter.maximum:g}{unit}, got {number:g}{unit}{written}"
        )
    return number


_SCALARS: Final[Mapping[Any, Callable[[Parameter, Any], Any]]] = {
    bool: _truth,
    int: _whole,
    float: _real,
    str: _text,
}
