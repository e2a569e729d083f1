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


def _seeds(value: object) -> tuple[int, ...]:
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


def _listed(seeds: list[Any]) -> tuple[int, ...]:
    for seed in seeds:
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise ValueError(f"a seed is a whole number of at least 0, got {show(seed)}")
    if not seeds:
        raise ValueError("must not be empty")
    seed, count = Counter(seeds).most_common(1)[0]
    if count > 1:
        raise ValueError(f"the seed {seed} is listed twice")
    return tuple(seeds)


Seeds = Annotated[tuple[int, ...], BeforeValidator(_seeds)]
Settings = dict[Text, Any]
"""Values of the scenario by their paths, as `nlosim run --set PATH=VALUE` sets them."""


class ExperimentFile(BaseModel):
    """A scenario, the seeds to run it with, and what to vary."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )

    version: Annotated[Literal[1], Field(alias="schema")]
    """The version of the form of this file."""

    scenario: Text
    """The scenario file, relative to this file."""

    seeds: Seeds
    """How many (`50` means 1 to 50), a range (`1..50`) or a list. Every combination of levels is
    run with the same seeds (common random numbers)."""

    factors: dict[Name, Annotated[dict[Text, Settings], Field(min_length=1)]] = {}
    """What is varied: by the name of the factor and of the level, the values that it sets."""

    fixed: Annotated[Settings, Field(alias="set")] = {}
    """Values that are set in every run."""

    metrics: Annotated[dict[Name, Text], Field(min_length=1)]
    """Columns of the results, each with its path in the metrics of a run: `prr.end_to_end`."""
