"""Where the numbers of the relay study come from, and what every method costs."""

from typing import Any

from orchestrator.experiment.report import Results
from studies.method.origin import cost, origin
from studies.relay.sample import METHOD, Condition


def provenance(results: Results, base: Condition) -> dict[str, Any]:
    """For the file: `base` is the condition of Table II, empty where there is none."""
    experiment, *rest = origin(results).items()
    return dict([experiment, ("base", dict(base)), *rest, ("cost", cost(results, METHOD))])
