"""Parameters of a learner: from what a training file says to what the learner receives."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.parameters import REQUIRED, Parameter, ParameterProblem
from orchestrator.scenario import values
from orchestrator.suggestion import suggestion


@dataclass(frozen=True, slots=True, kw_only=True)
class Converted:
    """Parameters as a learner receives them.

    Attributes:
        values: in the declared type and unit; those that were not given are missing.
        problems: with the others.
    """

    values: Mapping[str, Any]
    problems: list[ParameterProblem]


def converted(
    declared: Mapping[str, Parameter], given: Mapping[str, Any], folder: Path
) -> Converted:
    """The parameters that were given, and everything that is wrong with them.

    Args:
        declared: what the learner declares.
        given: what the training file says.
        folder: where relative paths start.
    """
    found, problems = {}, []
    for name, value in given.items():
        if name not in declared:
            what = f"there is no parameter `{name}`; {suggestion(name, declared)}"
            problems.append(ParameterProblem((name,), what, at_key=True))
            continue
        try:
            found[name] = values.convert(declared[name], value, folder)
        except values.ValueProblem as problem:
            problems.append(ParameterProblem((name, *problem.item), str(problem)))
    for name, parameter in declared.items():
        if parameter.default is REQUIRED and name not in given:
            kind = values.kind_name(parameter.type)
            what = f"the parameter `{name}` is missing: {kind}, {parameter.doc}"
            problems.append(ParameterProblem((), what, at_key=True))
    return Converted(values=found, problems=problems)
