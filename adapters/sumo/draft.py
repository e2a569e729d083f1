"""A scenario for a SUMO scene that somebody brings: traffic, radios and BSMs, no ego vehicle."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from adapters.sumo.files import SceneFiles
from orchestrator.scenario.units import format_duration
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, nanoseconds

_STEP: Final = nanoseconds("0.1")
"""The step of traffic whose configuration is silent: radios send ten BSMs a second."""

_SHORTEST, _LONGEST = nanoseconds("0.001"), nanoseconds("10")
"""Steps that `sumo-traffic` takes."""

_SHOWN: Final = 8
"""Names of outputs that are written out."""

_RADIO_STEP: Final = nanoseconds("0.01")
_SHORT: Final = 60 * NANOSECONDS_PER_SECOND
"""The simulated time of a scene that sets no end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A scenario file and what it takes for granted.

    Attributes:
        text: of the file.
        assumptions: a sentence each.
    """

    text: str
    assumptions: tuple[str, ...]


def draft(files: SceneFiles, folder: Path) -> Draft:
    """A runnable scenario for a scene.

    Args:
        files: of the scene.
        folder: that the scenario file will be in; the scene is named relative to it.
    """
    assumed = []
    start = files.begin or 0
    step, note = _step(files.step_length)
    assumed.append(note)
    grid = math.lcm(step, _radio_step(step))
    if files.end is None or files.end < start + grid:
        stop = start + max(_SHORT - _SHORT % grid, grid)
        what = "sets no end" if files.end is None else "ends within its first step"
        assumed.append(f"the scene {what}: the run takes {format_duration(stop - start)}")
    else:
        stop = files.end - (files.end - start) % grid
        assumed.append("time is that of the scene, from its begin to its end")
    said = "" if files.seed is None else f"; for the scene's own set `sumo_seed: {files.seed}`"
    assumed += [
        "every vehicle with an engine has a radio, nobody a lidar; `equipment` says otherwise",
        "heights, shapes and antennas are those of SUMO's classes where types say nothing",
        "polygons of type `building` or `building.*` shadow the radio, 10 m high unless they tell",
        "radio parameters are the defaults of `channel` and `facilities`: BSMs ten times a second",
        f"SUMO's random numbers come from the scenario's seed{said}",
    ]
    if files.outputs:
        names = list(dict.fromkeys(f"`{each.path.name}`" for each in files.outputs))
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        assumed.append(
            f"SUMO writes the files that the scene names: {', '.join(names[:_SHOWN])}{more}"
        )
    scene = files.config.absolute()
    scene = scene.relative_to(folder) if scene.is_relative_to(folder) else scene
    times = f"{{start: {format_duration(start)}, stop: {format_duration(stop)}}}"
    return Draft(text=_text(scene, times, step, assumed), assumptions=tuple(assumed))


def _step(said: Duration | None) -> tuple[Duration, str]:
    """The step of the traffic and why."""
    if said is None:
        return _STEP, (
            "the scene leaves SUMO's step at 1 s: here it is 100 ms, so that radios meet vehicles "
            "where they are; trajectories differ from those of `sumo -c`"
        )
    if said % _SHORTEST or not _SHORTEST <= said <= _LONGEST:
        return _STEP, (
            f"SUMO's step is 100 ms, not the scene's, {format_duration(said)}, which is not a "
            "whole number of milliseconds up to 10 s"
        )
    return said, f"SUMO's step is that of the scene, {format_duration(said)}"


def _radio_step(step: Duration) -> Duration:
    return min(_RADIO_STEP, step)


def _text(scene: Path, times: str, step: Duration, assumed: list[str]) -> str:
    radio = format_duration(_radio_step(step))
    notes = "\n".join(f"#   * {each}" for each in assumed)
    title = scene.name.removesuffix(".sumocfg")
    own = format_duration(step)
    return f"""\
# Made by `nlosim scene new {scene.name}`. What it takes for granted:
{notes}
schema: 1
title: {_quoted(title)}
description: {_quoted(f"All traffic of {scene.name} with radios that send BSMs.")}
time: {times}
seed: 1
coupling:
  algorithm: gauss-seidel
  order: [traffic, channel, facilities]
components:
  traffic:
    type: sumo-traffic
    step: {own}
    process: on-request
    parameters:
      scene: {_quoted(str(scene))}
      step_length: {own}
      equipment: {{all: {{radio: 1, lidar: 0}}}}
  facilities:
    type: facilities
    step: {radio}
  channel:
    type: channel
    step: {radio}
    process: on-request
connections:
  - {{from: traffic.vehicle, to: facilities.vehicle}}
  - {{from: channel.receptions, to: facilities.receptions}}
  - {{from: traffic.vehicle, to: channel.vehicle}}
  - {{from: traffic.building, to: channel.building}}
  - {{from: facilities.packets, to: channel.packets}}
"""


def _quoted(text: str) -> str:
    """A YAML text in single quotes."""
    return "'" + text.replace("'", "''") + "'"
