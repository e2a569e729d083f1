"""Parameters of a learner: from what a training file says to what the learner receives."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.parameters import Parameter, ParameterProblem
from orchestrator.scenario.conversion import Conversion


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
    conversion = Conversion(lambda _: folder)
    found = conversion.parameters(declared, given)
    return Converted(values=found, problems=conversion.problems)
