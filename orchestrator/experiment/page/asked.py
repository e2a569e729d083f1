"""What a page says about an experiment: what was asked, what is there, where it comes from."""

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from orchestrator.campaign.work import RunKey
from orchestrator.experiment.page.parts import Part
from orchestrator.experiment.plan import Combination, Experiment
from orchestrator.experiment.report import Results

_NUMBER: Final = re.compile(r"([-+]?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?)\s*(\D{0,12})")
"""A number and its unit, as levels are often called: `30 km/h`."""


def about(title: str, results: Results, parts: Sequence[Part]) -> Mapping[str, Any]:
    """The head of the page: what was planned and what became of it.

    Args:
        title: of the page.
        results: of all experiments.
        parts: these experiments.
    """
    planned = sum(part.planned for part in parts)
    return {
        "title": title,
        "seeds": ranges(results.experiment.seeds),
        "combinations": len(results.experiment.combinations),
        "common": sorted(_common(results.experiment.combinations)),
        "planned": planned,
        "done": len(results.rows),
        "failed": sum(row["error"] is not None for row in results.rows),
        "missing": planned - len(results.rows),
        "damaged": list(results.damaged),
        "parts": list(map(_part, parts)),
    }


def _part(part: Part) -> Mapping[str, Any]:
    experiment, results = part.experiment, part.results
    scenario = experiment.combinations[0].resolved
    return {
        "title": part.title,
        "scenario": str(experiment.scenario),
        "scenario_title": str(scenario.get("title") or experiment.scenario.stem),
        "description": str(scenario.get("description") or ""),
        "seeds": ranges(experiment.seeds),
        "combinations": len(experiment.combinations),
        "planned": part.planned,
        "missing": part.planned - len(results.rows),
        "go_on": _go_on(results.sessions, part.directory),
        "sessions": list(results.sessions),
        "resolved": scenario,
    }


def ranges(seeds: Iterable[int]) -> str:
    """Seeds in words: `1 to 50, 60`."""
    found: list[list[int]] = []
    for seed in sorted(seeds):
        if found and seed == found[-1][-1] + 1:
            found[-1] = [found[-1][0], seed]
        else:
            found.append([seed])
    return ", ".join(" to ".join(map(str, each)) for each in found)


def _go_on(sessions: Sequence[Mapping[str, Any]], directory: Path) -> str:
    """The command that runs what is missing."""
    said = str(sessions[-1].get("command", "")) if sessions else "nlosim experiment FILE"
    out = "" if " --out " in said else f" --out {shlex.quote(str(directory.absolute()))}"
    return f"{said}{out} --resume"


def factors(experiment: Experiment) -> list[Mapping[str, Any]]:
    """Factors with their levels, what all runs with one set, and the numbers that levels are."""
    common = _common(experiment.combinations)
    found: list[Mapping[str, Any]] = []
    for name, levels in experiment.levels.items():
        sets = [
            sorted(
                _common([c for c in experiment.combinations if c.levels[name] == level]) - common
            )
            for level in levels
        ]
        found.append({"name": name, "levels": list(levels), "sets": sets, **numbers(levels)})
    return found


def numbers(levels: Sequence[str]) -> Mapping[str, Any]:
    """Levels as numbers with a unit, if that is what all of them are; else `numbers` is `None`."""
    read = [_NUMBER.fullmatch(level.strip()) for level in levels]
    known = [found for found in read if found is not None]
    units = {found[2].strip() for found in known}
    values = [float(found[1]) for found in known]
    if len(known) < len(levels) or len(units) > 1 or len(set(values)) < max(2, len(levels)):
        return {"numbers": None, "unit": ""}
    return {"numbers": values, "unit": units.pop()}


def _common(combinations: Sequence[Combination]) -> frozenset[str]:
    """The overrides that all of them have."""
    sets = [frozenset(each.overrides) for each in combinations]
    return frozenset.intersection(*sets) if sets else frozenset()


def commands(parts: Sequence[Part], kept: Sequence[Combination]) -> Mapping[str, Any]:
    """What the commands that repeat runs are made of; a script joins it.

    Args:
        parts: the experiments whose runs they are.
        kept: combinations of all of them that are on the page.

    Returns:
        `settings`: every override once; `quoted`: each as a shell wants it; `of`: of each
        combination the indices of its own; `parts`: of each experiment its first combination, and
        `head` and `tail`: what stands before the seed, and between it and the settings.
    """
    settings = list(dict.fromkeys(text for each in kept for text in each.overrides))
    at = {text: index for index, text in enumerate(settings)}
    return {
        "settings": settings,
        "quoted": list(map(shlex.quote, settings)),
        "of": [[at[text] for text in each.overrides] for each in kept],
        "parts": [{"first": part.first, **_ends(part.experiment)} for part in parts],
    }


def _ends(experiment: Experiment) -> Mapping[str, str]:
    head = shlex.join(["nlosim", "run", str(experiment.scenario), "--seed"])
    tail = experiment.command(RunKey(0, 0))[len(head) + 2 :]
    own = "".join(f" --set {shlex.quote(text)}" for text in experiment.combinations[0].overrides)
    return {"head": head, "tail": tail.removesuffix(own)}
