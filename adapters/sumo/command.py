"""`nlosim scene new|show`, found by the entry point group `orchestrator.commands`."""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from adapters.sumo.draft import draft
from adapters.sumo.files import read_scene
from adapters.traffic.geometry import Float
from orchestrator.cli.command import command
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.component import Component
from orchestrator.errors import ComponentError, CosimError
from orchestrator.randomness import stream
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.units import duration, format_duration
from orchestrator.signal import Causality, Connector, Signals

_DRAWN: Final = ("vehicle.position", "road.vertex", "building.vertex")
"""A component with these outputs is a source of traffic."""

_NEW: Final = """\
The scenario has all traffic of the scene, a radio in every vehicle, BSMs and the radio channel, and
no ego vehicle. It names what it takes for granted; edit it, or declare `entities`.

  nlosim scene new city.sumocfg
  nlosim run city.yaml
"""
_SHOW: Final = """\
Draws what the traffic component shows: roads, buildings, lights, every vehicle and person; declared
entities have their names. Without `--at` it is the first communication point.

  nlosim scene show city.yaml --at 120s --out city.png
"""


def add_command(commands: Any) -> None:
    """Add `scene` to the subparsers of the command line.

    Each of its parsers has the default `execute`: parsed arguments to `Outcome`.
    """
    scene = commands.add_parser("scene", help="a scenario for a SUMO net; a picture of a scenario")
    actions = scene.add_subparsers(dest="action", required=True, metavar="ACTION")
    maker = command(actions, "new", "write a runnable scenario for a SUMO scene", _NEW, execute=new)
    maker.add_argument("config", type=Path, metavar="FILE.sumocfg", help="SUMO configuration")
    maker.add_argument(
        "--out", type=Path, metavar="FILE.yaml", help="default: beside where you are, NAME.yaml"
    )
    viewer = command(actions, "show", "draw the scene of a scenario", _SHOW, execute=show)
    viewer.add_argument("scenario", help="a scenario file, or the name of an installed scenario")
    viewer.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="PATH=VALUE"
    )
    viewer.add_argument("--seed", type=int, help="instead of the scenario's")
    viewer.add_argument("--at", metavar="TIME", help="after the start, for example 30s")
    viewer.add_argument("--around", metavar="NAME", help="this entity in the middle")
    viewer.add_argument(
        "--radius", type=float, default=60.0, metavar="METRES", help="with --around (default: 60)"
    )
    viewer.add_argument("--out", type=Path, default=Path("scene.png"), help="PNG, SVG or PDF")


def new(arguments: argparse.Namespace) -> Outcome:
    """Write a scenario for a scene."""
    config: Path = arguments.config
    if not config.is_file():
        return failure("scene", Exit.WRONG_INPUT, f"there is no file {config}")
    files, problems = read_scene(config)
    if problems:
        return failure("scene", Exit.WRONG_INPUT, "\n".join(map(str, problems)))
    out: Path = arguments.out or Path(f"{config.name.removesuffix('.sumocfg')}.yaml")
    if out.exists():
        return failure("scene", Exit.WRONG_INPUT, f"{out} exists; name another file by `--out`")
    made = draft(files, out.absolute().parent)
    try:
        out.write_text(made.text, encoding="utf-8")
    except OSError as error:
        return failure("scene", Exit.WRONG_INPUT, f"{out} cannot be written: {error.strerror}")
    assumed = [f"  * {each}" for each in made.assumptions]
    text = "\n".join([f"{out}: it assumes that", *assumed, "", f"run it with `nlosim run {out}`"])
    return Outcome(text=text, data={"out": str(out), "assumptions": list(made.assumptions)})


def show(arguments: argparse.Namespace) -> Outcome:
    """Draw a scene."""
    from adapters.traffic.drawing import View, draw  # noqa: PLC0415 - it takes a second

    scenario = load_scenario(scenario_path(arguments.scenario), arguments.overrides)
    elapsed = 0 if arguments.at is None else duration(arguments.at)
    seed = scenario.seed if arguments.seed is None else arguments.seed
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
        figure = draw(signals, names, f"{scenario.title}, {when}, seed {seed}", view)
        figure.savefig(arguments.out, dpi=130)
        count = len(np.asarray(signals["vehicle.id"]))
        return Outcome(
            text=f"{arguments.out}: {count} road users at {when}",
            data={"out": str(arguments.out), "road_users": count},
        )
    what = "no component of the scenario is a source of traffic: none has `vehicle` and `road`"
    return failure("scene", Exit.WRONG_INPUT, what)


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
    for k in range(-(-elapsed // use.step)):
        component.step(inputs, scenario.start + k * use.step, use.step)
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
