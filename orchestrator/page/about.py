"""What a page says about the run: what it was, how it ended, how to repeat it, its wiring."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from orchestrator.recording.layout import MANIFEST

_USUAL_TRANSPORT: Final = "in-process"
_ELSEWHERE: Final = frozenset({"scenario", "wall_time_s", "recorded_bytes"})
"""Keys of the manifest that the page has, too, but not in the list of all that is left."""


def about(manifest: Mapping[str, Any]) -> Mapping[str, Any]:
    """The head of the page, and what the manifest says."""
    scenario = manifest.get("scenario", {})
    return {
        "title": title(manifest),
        "description": str(scenario.get("description") or ""),
        "status": manifest.get("status"),
        "error": manifest.get("error"),
        "ended_early": manifest.get("ended_early"),
        "seed": manifest.get("seed"),
        "fingerprint": manifest.get("fingerprint"),
        "command": command(manifest),
        "manifest": {key: value for key, value in manifest.items() if key not in _ELSEWHERE},
        "scenario": scenario,
        "wall_time": manifest.get("wall_time_s"),
        "manifest_file": MANIFEST,
    }


def title(manifest: Mapping[str, Any]) -> str:
    """What the run is called."""
    said = manifest.get("scenario", {}).get("title")
    return str(said or Path(str(manifest.get("scenario_file", "run"))).stem)


def command(manifest: Mapping[str, Any]) -> str:
    """The shell command that repeats the run, to be called where the scenario is."""
    words = ["nlosim", "run", str(manifest.get("scenario_file", "SCENARIO"))]
    if manifest.get("transport", _USUAL_TRANSPORT) != _USUAL_TRANSPORT:
        words += ["--transport", str(manifest["transport"])]
    for override in manifest.get("overrides", ()):
        words += ["--set", str(override)]
    return shlex.join(words)


def wiring(manifest: Mapping[str, Any]) -> Mapping[str, Any]:
    """Components in the order of their turns, and what is connected, as the scenario says it."""
    scenario = manifest.get("scenario", {})
    components: Mapping[str, Mapping[str, Any]] = scenario.get("components", {})
    turns = [name for name in manifest.get("turns", ()) if name in components]
    order = [*turns, *(name for name in components if name not in turns)]
    return {
        "components": [_component(name, components[name]) for name in order],
        "connections": list(_connections(scenario.get("connections", ()), components)),
        "coupling": scenario.get("coupling"),
    }


def _component(name: str, said: Mapping[str, Any]) -> Mapping[str, Any]:
    origin = str(said.get("type") or said.get("fmu") or "")
    return {
        "name": name,
        "type": origin.replace("\\", "/").rsplit("/", 1)[-1],
        "step": str(said.get("step", "")),
        "each": str(said.get("each") or ""),
        "parameters": said.get("parameters") or {},
    }


def _connections(
    said: Sequence[Mapping[str, Any]], components: Mapping[str, Any]
) -> Iterator[Mapping[str, str]]:
    for each in said:
        ends = str(each.get("from", "")), str(each.get("to", ""))
        source, target = (_component_of(end, components) for end in ends)
        if source and target:
            more = {k: str(v) for k, v in each.items() if k not in {"from", "to"} and v}
            yield {
                "source": source,
                "target": target,
                "from": ends[0],
                "to": ends[1],
                "way": ", ".join(f"{key} {value}" for key, value in more.items()),
            }


def _component_of(end: str, components: Mapping[str, Any]) -> str:
    """The component that an end of a connection names; empty if it is none."""
    found = [name for name in components if end == name or end.startswith(f"{name}.")]
    return max(found, key=len, default="")
