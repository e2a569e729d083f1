"""Where the numbers of the study come from, and what they cost."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from orchestrator.experiment.report import Results, Row
from orchestrator.scenario.units import duration

_VERSIONS: Final = ("nlosim", "python", "numpy", "libsumo", "matplotlib", "distributed")


def origin(results: Results) -> dict[str, Any]:
    """Everything that a reader needs to make the numbers again; no name of a host."""
    failed = sum(row["error"] is not None for row in results.rows)
    return {
        "experiment": str(results.experiment.path),
        "seeds": seeds_text(results.experiment.seeds),
        "planned": len(results.experiment.runs()),
        "runs": len(results.rows),
        "failed": failed,
        "sessions": [_session(session) for session in results.sessions],
    }


def seeds_text(seeds: Sequence[int]) -> str:
    """As an experiment file has them: a range if they are one."""
    if len(seeds) > 1 and list(seeds) == list(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]}..{seeds[-1]}"
    return ", ".join(map(str, seeds))


def _session(session: Mapping[str, Any]) -> dict[str, Any]:
    host = session["host"]
    return {
        "command": session["command"],
        "created": session["created"],
        "commit": session["commit"],
        "versions": {
            name: session["versions"][name] for name in _VERSIONS if name in session["versions"]
        },
        "machine": {name: host.get(name) for name in ("cpu", "cpus", "memory_gib", "platform")},
    }


def cost(results: Results, factor: str) -> list[dict[str, Any]]:
    """Wall time of one worker process over simulated time, per level and of all runs.

    Start, simulation and metrics of the run are in it; workers have one thread each, so it is
    processor time as long as every worker has a core for itself.
    """
    simulated = {
        tuple(one.levels.values()): _simulated(one.resolved)
        for one in results.experiment.combinations
    }
    done = [row for row in results.rows if row["error"] is None]
    factors = results.experiment.factors

    def of(name: str, rows: Iterable[Row]) -> dict[str, Any]:
        times = [(row["wall_s"], simulated[tuple(row[f] for f in factors)]) for row in rows]
        wall, time = sum(one[0] for one in times), sum(one[1] for one in times)
        return {
            factor: name,
            "runs": len(times),
            "wall_s": wall,
            "simulated_s": time,
            "wall_s_per_simulated_s": wall / time if time else None,
        }

    levels = results.experiment.levels[factor]
    each = [of(name, [row for row in done if row[factor] == name]) for name in levels]
    return [*each, of("all", done)]


def _simulated(scenario: Mapping[str, Any]) -> float:
    """The simulated time of a run of a resolved scenario [s]."""
    time = scenario["time"]
    return (duration(time["stop"]) - duration(time["start"])) / 1e9
