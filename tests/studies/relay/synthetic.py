"""Results of an experiment that never ran, with rates that we choose."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import Results
from orchestrator.scenario.document import Document

METRICS = {
    "prr": "prr.end_to_end",
    "direct_prr": "prr.direct",
    "relay_switches": "relay_switches",
    "collision_rate": "collision",
}
SESSION = {
    "command": "nlosim experiment study.yaml",
    "created": "2026-01-01T00:00:00+00:00",
    "commit": "abcdef",
    "versions": {"nlosim": "1", "python": "3.11", "pydantic": "2"},
    "host": {"name": "secret", "cpu": "a CPU", "cpus": 2, "memory_gib": 8.0, "platform": "Linux"},
}

Levels = Mapping[str, str]
Outcome = Callable[[Levels, int], Mapping[str, Any] | None]
"""Of levels and seed: the metrics, or `None` for a run that failed."""


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
    traffic = {"parameters": {"spacing": f"{spacing} m"}}
    return {
        "time": {"start": "0 s", "stop": "20 s"},
        "components": {"traffic": traffic, "relay": {"parameters": {}}},
    }


def results(plan: Experiment, outcome: Outcome, *, without: int | None = None) -> Results:
    """All runs, without those of one seed if `without` says so."""
    rows = []
    for combination in plan.combinations:
        for seed in plan.seeds:
            if seed == without:
                continue
            found = outcome(combination.levels, seed)
            metrics = dict.fromkeys(METRICS) if found is None else found
            error = "it broke" if found is None else None
            state = {"fingerprint": "0", "wall_s": 5.0, "error": error}
            rows.append({**combination.levels, "seed": seed, **metrics, **state})
    return Results(experiment=plan, rows=rows, metrics=[{} for _ in rows], sessions=[SESSION])


def run(prr: float | None, *, switches: int = 0, direct: float = 0.4) -> dict[str, Any]:
    """The metrics of a run."""
    return {"prr": prr, "direct_prr": direct, "relay_switches": switches, "collision_rate": False}
