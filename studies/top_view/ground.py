"""What does not move: roads, buildings, the signals of traffic lights."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.page.layer import PageOfRun
from orchestrator.signal import Array


def ground_of(run: PageOfRun, traffic: str) -> Mapping[str, Any]:
    """What is recorded of it.

    Args:
        run: whose page it is.
        traffic: the component.
    """
    found: dict[str, Any] = {}
    for group in ("road", "building"):
        vertex, index = (_fixed(run, f"{traffic}.{group}.{name}") for name in ("vertex", "index"))
        if vertex is not None and index is not None and len(index):
            ends = np.append(np.flatnonzero(np.diff(index)) + 1, len(index))
            found[group] = {
                "x": run.arrays.rounded(vertex[:, 0], 0.01),
                "y": run.arrays.rounded(vertex[:, 1], 0.01),
                "ends": run.arrays.add(ends, "i4", deltas=1),
            }
    place, heading = (_fixed(run, f"{traffic}.light.{name}") for name in ("position", "heading"))
    if place is not None and len(place) and f"{traffic}.light.state" in run.recording:
        found["light"] = {
            "x": run.arrays.rounded(place[:, 0], 0.01),
            "y": run.arrays.rounded(place[:, 1], 0.01),
            "heading": run.arrays.rounded(np.zeros(len(place)) if heading is None else heading),
            **_states(run, f"{traffic}.light.state"),
        }
    return found


def _fixed(run: PageOfRun, name: str) -> Array | None:
    if name not in run.recording or not len(run.recording[name]):
        return None
    return np.asarray(run.recording[name][0])


def _states(run: PageOfRun, name: str) -> Mapping[str, Any]:
    """What the signals show, whenever one of them changes."""
    series = run.recording[name]
    states = np.asarray(series.values).reshape(len(series), -1)
    changes = np.ones(len(states), bool)
    changes[1:] = (states[1:] != states[:-1]).any(axis=1)
    return {
        "times": run.times(series.times[changes]),
        "state": run.arrays.add(states[changes], "u1"),
    }
