"""`nlosim export`, found by the entry point group `orchestrator.commands`.

What the command does is loaded when it is called: the help needs neither NumPy nor any extra.
"""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import command
from orchestrator.cli.outcome import Outcome

_EXPORT: Final = """\
Without --out, what is written is in DIR/export. Nothing is replaced without --force. Of a run that
is damaged, was killed or goes on, what can be read is exported, and what is left out is said.
docs/exports.md says what is in each format.

examples:
  nlosim export runs/red_light-1 --parquet
  nlosim export runs/red_light-1 --csv --signal 'traffic.vehicle.*' --signal channel.receptions
  nlosim export runs/red_light-1 --fcd --out red_light-fcd
  nlosim export runs/red_light-1 --mcap
"""

FORMATS: Final = {
    "csv": "tables of signals, one row per time and element: a folder of CSV files, units in\n"
    "the headings",
    "parquet": "likewise Parquet files, units in the metadata (extra `parquet`)",
    "fcd": "vehicles and persons as SUMO's floating car data (fcd-export), and their types",
    "mcap": "the scene for Foxglove and Lichtblick, by Foxglove's schemas (extra `mcap`)",
    "rerun": "the same for Rerun, with links and messages (extra `rerun`)",
    "osi": "traces of ASAM OSI: GroundTruth, and SensorView of each lidar (extra `osi`)",
}
"""What the formats are, by name."""


_VIEW: Final = """\
With --page, any browser shows the page of the run (docs/run-page.md), which a run that goes on
makes anew every few seconds: nothing else is needed. Otherwise Foxglove or Lichtblick show it, and
the extra `mcap` is needed: a run that goes on is followed; a finished one is played when a viewer
comes, as fast as --speed says, and can be paused and moved where the viewer has controls for it.
Both are read only, and only this machine can reach them unless --host says otherwise.

examples:
  nlosim view --page --live
  nlosim view --page runs/red_light-1
  nlosim view runs/red_light-1
"""


def add_view(commands: Any) -> None:
    """Add `view` to the subparsers of the command line, likewise."""
    view = command(
        commands,
        "view",
        "show a run in a browser, in Foxglove or Lichtblick, also while it runs",
        _VIEW,
        execute=_view,
    )
    view.add_argument(
        "directory",
        metavar="DIR",
        type=Path,
        nargs="?",
        help="of a run (default: the one in `runs` that was begun last)",
    )
    view.add_argument("--page", action="store_true", help="its page, in any browser")
    view.add_argument("--live", action="store_true", help="only a run that goes on")
    view.add_argument("--host", default="127.0.0.1", help="default: 127.0.0.1")
    view.add_argument("--port", type=int, default=8765, help="default: 8765; 0: one that is free")
    view.add_argument(
        "--speed", type=float, default=1.0, metavar="FACTOR", help="simulated seconds per second"
    )


def add_command(commands: Any) -> None:
    """Add `export` to the subparsers of the command line.

    Its parser has the default `execute`: parsed arguments to `Outcome`.
    """
    export = command(
        commands, "export", "write a run in a format of other tools", _EXPORT, execute=_export
    )
    export.add_argument("directory", metavar="DIR", type=Path, help="of a run")
    formats = export.add_mutually_exclusive_group(required=True)
    for name, what in FORMATS.items():
        formats.add_argument(
            f"--{name}", dest="format", action="store_const", const=name, help=what
        )
    export.add_argument("--out", metavar="PATH", type=Path, help="of the file or folder instead")
    export.add_argument(
        "--signal",
        dest="signals",
        action="append",
        default=[],
        metavar="NAME",
        help="of tables: only `component.connector`; * and ? stand for any letters.\n"
        "May be given several times",
    )
    export.add_argument(
        "--geo",
        action="store_true",
        help="of --fcd: x and y are longitude and latitude, as SUMO's --fcd-output.geo; needs a\n"
        "net with a projection",
    )
    export.add_argument("--force", action="store_true", help="replace what is there")


def _export(arguments: argparse.Namespace) -> Outcome:
    from studies.exports.execution import execute  # noqa: PLC0415 - heavy

    return execute(arguments)


def _view(arguments: argparse.Namespace) -> Outcome:
    from studies.exports.viewing import execute  # noqa: PLC0415 - heavy

    return execute(arguments)
