"""The shape of an experiment file."""

import re
from collections import Counter
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from orchestrator.scenario.diagnosis import show
from orchestrator.scenario.schema import Name, Text

_RANGE: Final = re.compile(r"([0-9]{1,18})\s*\.\.\s*([0-9]{1,18})")

MAXIMUM_RUNS: Final = 1_000_000
"""More seeds, or runs, than that are a slip of the pen."""


def seeds(value: object) -> tuple[int, ...]:
    """What `seeds` in an experiment file, or `--seeds`, means.

    Raises:
        ValueError: with a sentence.
    """
    match value:
        case bool():
            pass
        case int():
            if not 1 <= value <= MAXIMUM_RUNS:
                raise ValueError(f"must be between 1 and {MAXIMUM_RUNS} seeds, got {show(value)}")
            return tuple(range(1, value + 1))
        case str() if found := _RANGE.fullmatch(value.strip()):
            first, last = map(int, found.groups())
            if not first <= last < first + MAXIMUM_RUNS:
                raise ValueError(f'"{value}" is not a range of 1 to {MAXIMUM_RUNS} seeds')
            return tuple(range(first, last + 1))
        case list():
            return _listed(value)
    what = "a number of seeds, a range such as `1..50`, or a list of seeds"
    raise ValueError(f"expected {what}, got {show(value)}")


def _listed(values: list[Any]) -> tuple[int, ...]:
    for seed in values:
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise ValueError(f"a seed is a whole number of at least 0, got {show(seed)}")
    if not values:
        raise ValueError("must not be empty")
    seed, count = Counter(values).most_common(1)[0]
    if count > 1:
        raise ValueError(f"the seed {seed} is listed twice")
    return tuple(values)


Seeds = Annotated[tuple[int, ...], BeforeValidator(seeds)]
Settings = dict[Text, Any]
"""Values of the scenario by their paths, as `nlosim run --set PATH=VALUE` sets them."""


def _levels(value: object) -> object:
    match value:
        case str():
            return [value]
        case list():
            return value
    hint = f"; write '{value}' in quotes" if isinstance(value, int | float) else ""
    raise ValueError(f"expected a level or a list of levels, got {show(value)}{hint}")


Levels = Annotated[list[Text], BeforeValidator(_levels), Field(min_length=1)]
"""One level, or several, of a factor."""


class _Mapping(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )


class ReportChoice(_Mapping):
    """A report over all runs, and its parameters."""

    type: Text
    """Its name among the installed ones (entry points `orchestrator.experiment_reports`)."""

    parameters: dict[Text, Any] = {}
    """Which there are depends on the report."""


def _report(value: object) -> object:
    return {"type": value} if isinstance(value, str) else value


def _metric(value: object) -> object:
    match value:
        case str() if value:
            return value
        case dict() if all(isinstance(key, str) for key in value):
            return value
    what = (
        "a path in the metrics of a run, `prr.end_to_end`, or `{signal: plant.x, statistic: mean}`"
    )
    raise ValueError(f"expected {what}, got {show(value)}")


Metric = Annotated[str | dict[str, Any], BeforeValidator(_metric)]
"""A path in the metrics of a run, or the parameters of the measure `signal`."""


class ExperimentFile(_Mapping):
    """A scenario, the seeds to run it with, and what to vary."""

    version: Annotated[Literal[1], Field(alias="schema")]
    """The version of the form of this file."""

    scenario: Text
    """The scenario file, relative to this file, or an installed scenario by its name."""

    seeds: Seeds
    """How many (`50` means 1 to 50), a range (`1..50`) or a list. Every combination of levels is
    run with the same seeds (common random numbers)."""

    factors: dict[Name, Annotated[dict[Text, Settings], Field(min_length=1)]] = {}
    """What is varied: by the name of the factor and of the level, the values that it sets."""

    skip: list[Annotated[dict[Name, Levels], Field(min_length=1)]] = []
    """Combinations to leave out: those that have, of every factor named, one of the levels."""

    fixed: Annotated[Settings, Field(alias="set")] = {}
    """Values that are set in every run."""

    metrics: Annotated[dict[Name, Metric], Field(min_length=1)]
    """Columns of the results: each with its path in the metrics of a run, `prr.end_to_end`, or with
    what it is of a recorded signal, `{signal: plant.x, statistic: maximum}`."""

    report: Annotated[ReportChoice | None, BeforeValidator(_report)] = None
    """Makes tables and figures of all runs: its name, or `type` and `parameters`."""
