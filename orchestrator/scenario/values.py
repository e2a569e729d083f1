"""Parameter values: from what a scenario file says to what a component receives, and back."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from orchestrator.distribution import (
    Choice,
    Constant,
    DistributedText,
    Distribution,
    Normal,
    Uniform,
)
from orchestrator.kinds import is_record
from orchestrator.parameters import DRAWN, Parameter, ParameterProblem, declared
from orchestrator.scenario.conversion import Conversion
from orchestrator.scenario.units import difference


class ValueProblems(ValueError):  # noqa: N818 - sentences, to be located by the caller
    """A value that a parameter cannot take.

    Attributes:
        problems: each with its address within the value.
    """

    def __init__(self, problems: list[ParameterProblem]) -> None:
        super().__init__("\n".join(problem.what for problem in problems))
        self.problems = tuple(problems)


def convert(parameter: Parameter, value: Any, folder: Path) -> Any:
    """The value in the type and unit of `parameter`.

    Args:
        parameter: what the component type declares.
        value: what the scenario file says.
        folder: where relative paths start.

    Raises:
        ValueProblems: the value does not fit; everything that is wrong with it.
    """
    conversion = Conversion(lambda _: folder)
    converted = conversion.value(parameter.type, parameter, value, ())
    if conversion.problems:
        raise ValueProblems(conversion.problems)
    return converted


def written(parameter: Parameter, value: Any) -> Any:
    """`value` as a scenario file would say it: what `convert` turns into `value` again.

    Of a record all fields are written, also those with their defaults.
    """
    if isinstance(value, Distribution | DistributedText):
        return _distribution(parameter, value)
    if isinstance(value, tuple):
        return [written(parameter, item) for item in value]
    if isinstance(value, Mapping):
        return {name: written(parameter, each) for name, each in value.items()}
    if is_record(type(value)):
        fields = {n: (p, getattr(value, n)) for n, p in declared(type(value)).items()}
        return {n: written(p, each) for n, (p, each) in fields.items() if each is not DRAWN}
    if isinstance(value, Path):
        return str(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value!r} {parameter.unit}" if is_number and parameter.unit != "1" else value


def _distribution(parameter: Parameter, value: Distribution | DistributedText) -> Any:
    match value:
        case Constant(only) | DistributedText((only,), ()):
            return written(parameter, only)
        case Uniform(low, high):
            return {"uniform": written(parameter, (low, high))}
        case Normal(mean, deviation, low, high):
            step = dataclasses.replace(parameter, unit=difference(parameter.unit))
            said = {"mean": written(parameter, mean), "deviation": written(step, deviation)}
            bounds = {"low": low, "high": high}
            finite = {n: written(parameter, b) for n, b in bounds.items() if math.isfinite(b)}
            return {"normal": {**said, **finite}}
        case Choice(values, ()) | DistributedText(values, ()):
            return {"choice": written(parameter, values)}
        case Choice(values, weights) | DistributedText(values, weights):
            return {"choice": {"values": written(parameter, values), "weights": list(weights)}}
    raise TypeError(f"{type(value).__name__} cannot be written in a scenario file")
