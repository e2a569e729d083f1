"""`nlosim scene new|show`, found by the entry point group `orchestrator.commands`.

What the commands do is loaded when they are called: the help needs neither SUMO nor NumPy.
"""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import command, seed
from orchestrator.cli.outcome import Outcome

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
    maker = command(
        actions, "new", "write a runnable scenario for a SUMO scene", _NEW, execute=_new
    )
    maker.add_argument("config", type=Path, metavar="FILE.sumocfg", help="SUMO configuration")
    maker.add_argument(
        "--out", type=Path, metavar="FILE.yaml", help="default: beside where you are, NAME.yaml"
    )
    viewer = command(actions, "show", "draw the scene of a scenario", _SHOW, execute=_show)
    viewer.add_argument("scenario", help="a scenario file, or the name of an installed scenario")
    viewer.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="PATH=VALUE"
    )
    viewer.add_argument("--seed", type=seed, help="instead of the scenario's")
    viewer.add_argument("--at", metavar="TIME", help="after the start, for example 30s")
    viewer.add_argument("--around", metavar="NAME", help="this entity in the middle")
    viewer.add_argument(
        "--radius", type=float, default=60.0, metavar="METRES", help="with --around (default: 60)"
    )
    viewer.add_argument("--out", type=Path, default=Path("scene.png"), help="PNG, SVG or PDF")


def _new(arguments: argparse.Namespace) -> Outcome:
    from adapters.sumo.command import new  # noqa: PLC0415 - heavy

    return new(arguments)


def _show(arguments: argparse.Namespace) -> Outcome:
    from adapters.sumo.command import show  # noqa: PLC0415 - heavy

    return show(arguments)
