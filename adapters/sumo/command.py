"""What `nlosim scene new` and `show` do."""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from adapters.sumo.checking import check_scene
from adapters.sumo.draft import draft
from adapters.traffic.geometry import Float
from orchestrator.cli.failures import problem_data
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.component import Component
from orchestrator.errors import ComponentError, CosimError
from orchestrator.randomness import stream
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.units import duration, format_duration
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import CommunicationGrid, seconds
from orchestrator.units import UnitError

_DRAWN: Final = ("vehicle.position", "road.vertex", "building.vertex")
"""A component with these outputs is a source of traffic."""

_PICTURES: Final = (".png", ".svg", ".pdf")


def new(arguments: argparse.Namespace) -> Outcome:
    """Write a scenario for a scene."""
    config: Path = arguments.config
    if not config.is_file():
        return failure("scene", Exit.WRONG_INPUT, f"there is no file {config}")
    found = check_scene(config, thorough=False)
    if found.problems:
        return failure("scene", Exit.WRONG_INPUT, "\n".join(map(str, found.problems)))
    out: Path = arguments.out or Path(f"{config.name.removesuffix('.sumocfg')}.yaml")
    if out.exists():
        return failure("scene", Exit.WRONG_INPUT, f"{out} exists; name another file by `--out`")
    made = draft(found.files, out.absolute().parent)
    try:
        out.write_text(made.text, encoding="utf-8")
    except OSError as error:
        return failure("scene", Exit.WRONG_INPUT, f"{out} cannot be written: {error.strerror}")
    assumed = [f"  * {each}" for each in made.assumptions]
    lines = [
        f"{out}: it assumes that",
        *assumed,
        *(f"{remark} (a remark)" for remark in found.remarks),
        "",
        f"run it with `nlosim run {out}`",
    ]
    data = {
        "out": str(out),
        "assumptions": list(made.assumptions),
        **({"remarks": [problem_data(each) for each in found.remarks]} if found.remarks else {}),
    }
    return Outcome(text="\n".join(lines), data=data)


def show(arguments: argparse.Namespace) -> Outcome:
    """Draw a scene."""
    from adapters.traffic.drawing import DPI, View, draw  # noqa: PLC0415 - it takes a second

    overrides = list(arguments.overrides)
    if arguments.seed is not None:
        overrides.append(f"seed={arguments.seed}")
    try:
        elapsed = 0 if arguments.at is None else duration(arguments.at)
    except UnitError as error:
        return failure("scene", Exit.WRONG_INPUT, f"`--at`: {error}")
    if what := _unwritable(arguments.out):
        return failure("scene", Exit.WRONG_INPUT, f"`--out`: {what}")
    scenario = load_scenario(scenario_path(arguments.scenario), overrides)
    seed = scenario.seed
    for use in scenario.components.values():
        component = use.type.create(use.name, use.values)
        try:
            if not _is_traffic(component.connectors):
                continue
            signals, names = _at(component, use, scenario, seed, elapsed)
        except CosimError as error:
            raise ComponentError(use.name, scenario.start, str(error)) from error
        finally:
            component.close()
        when = format_duration(scenario.start + elapsed)
        view = None
        if arguments.around is not None:
            center = _center(signals, names, arguments.around)
            if center is None:
                here = ", ".join(sorted(names.values())) or "none"
                what = f"no entity `{arguments.around}` is there at {when}; those that are: {here}"
                return failure("scene", Exit.WRONG_INPUT, what)
            view = View(center=center, radius=arguments.radius)
        title = f"{scenario.title}, {seconds(scenario.start + elapsed):g} s, seed {seed}"
        figure = draw(signals, names, title, view)
        figure.savefig(arguments.out, dpi=DPI)
        count = len(np.asarray(signals["vehicle.id"]))
        return Outcome(
            text=f"{arguments.out}: {count} road users at {when}",
            data={"out": str(arguments.out), "road_users": count},
        )
    what = "no component of the scenario is a source of traffic: none has `vehicle` and `road`"
    return failure("scene", Exit.WRONG_INPUT, what)


def _unwritable(out: Path) -> str | None:
    """Why no picture can be written to a path; `None` if it can."""
    if out.suffix.lower() not in _PICTURES:
        return f"{out} is no picture; end its name with {', '.join(_PICTURES)}"
    if not out.absolute().parent.is_dir():
        return f"there is no folder {out.parent}"
    return None


def _is_traffic(connectors: Mapping[str, Connector]) -> bool:
    return all(
        name in connectors and connectors[name].causality is Causality.OUTPUT for name in _DRAWN
    )


def _at(
    component: Component, use: ComponentUse, scenario: Scenario, seed: int, elapsed: int
) -> tuple[Signals, Mapping[int, str]]:
    """The outputs some time after the start, nobody commanding anything; names of entities."""
    inputs = {
        name: connector.start_value()
        for name, connector in component.connectors.items()
        if connector.causality is Causality.INPUT
    }
    component.setup(scenario.start, stream(seed, use.name))
    component.initialise(inputs)
    signals = component.outputs()
    names = _entered(signals)
    grid = CommunicationGrid(scenario.start, use.step, int(-(-elapsed // use.step)))
    for t in grid:
        component.step(inputs, t, grid.after(t) - t)
        signals = component.outputs()
        names |= _entered(signals)
    numbers, roles = (np.asarray(signals[f"vehicle.{key}"]).tolist() for key in ("id", "role"))
    declared = {number for number, role in zip(numbers, roles, strict=True) if role}
    return signals, {number: names.get(number, "") for number in declared}


def _center(signals: Signals, names: Mapping[int, str], name: str) -> Float | None:
    """Where the entity `name` is [m], shape (2,); `None` if it is not there."""
    for number, position in zip(
        np.asarray(signals["vehicle.id"]).tolist(),
        np.asarray(signals["vehicle.position"]),
        strict=True,
    ):
        if names.get(number) == name:
            center: Float = position[:2]
            return center
    return None


def _entered(signals: Signals) -> dict[int, str]:
    entered = json.loads(bytes(signals["entered"]) or b"[]")
    return {number: name for number, name, _ in entered}
