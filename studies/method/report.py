"""What the reports of studies check alike before the first run."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from orchestrator.experiment.plan import Experiment
from orchestrator.parameters import ParameterProblem
from orchestrator.suggestion import suggestion


def parameters(experiment: Experiment) -> Mapping[str, Any]:
    """The parameters of the report of `experiment`."""
    assert experiment.report is not None  # noqa: S101 - a report is asked for its own experiments
    return experiment.report.parameters


def unknown_parameters(
    experiment: Experiment, known: Collection[str]
) -> Iterator[ParameterProblem]:
    """A problem for every parameter that is none of `known`."""
    for name in parameters(experiment):
        if name not in known:
            hint = f"; {suggestion(name, known)}" if known else ""
            yield ParameterProblem((name,), f"there is no parameter `{name}`{hint}", at_key=True)


def missing(
    study: str, noun: str, needed: Mapping[str, str], offers: Collection[str]
) -> Iterator[ParameterProblem]:
    """A problem if `offers` do not have all that a study needs.

    Args:
        study: what its messages call it.
        noun: what is needed: `factor` or `metric`.
        needed: how messages show each, by name.
        offers: the names that an experiment has.
    """
    names = [f"`{shown}`" for name, shown in needed.items() if name not in offers]
    if names:
        yield ParameterProblem((), f"the {study} needs the {noun} {' and '.join(names)}")
