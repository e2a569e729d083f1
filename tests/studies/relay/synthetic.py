"""Results of an experiment that never ran, with rates that we choose."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.scenario.document import Document

METRICS = {
    "prr": "prr.end_to_end",
    "direct_prr": "prr.direct",
    "relay_switches": "relay_switches",
    "collision_rate": "collision",
}


def experiment(
    methods: tuple[str, ...],
    spacings: tuple[float, ...] = (30.0,),
    *,
    base: Mapping[str, Any] | None = None,
    seeds: int = 4,
) -> Experiment:
    """Methods by densities, of 20 s each."""
    combinations = [
        Combination({"method": method, "density": f"{spacing:g} m"}, (), _scenario(spacing))
        for method in methods
        for spacing in spacings
    ]
    parameters = {} if base is None else {"base": base}
    return Experiment(
        path=Path("study.yaml"),
        scenario=Path("scenario.yaml"),
        seeds=tuple(range(1, seeds + 1)),
        combinations=tuple(combinations),
        metrics=METRICS,
        report=ReportPlan(name="relay-study", parameters=parameters),
        document=Document("study.yaml", {}, {}),
    )


def _scenario(spacing: float) -> Mapping[str, Any]:
    traffic = {"parameters": {"background": {"spacing": f"{spacing} m"}}}
    return {
        "time": {"start": "0 s", "stop": "20 s"},
        "components": {"traffic": traffic, "relay": {"parameters": {}}},
    }


def run(prr: float | None, *, switches: int = 0, direct: float = 0.4) -> dict[str, Any]:
    """The metrics of a run."""
    return {"prr": prr, "direct_prr": direct, "relay_switches": switches, "collision_rate": False}
