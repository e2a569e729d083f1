"""`nlosim verify`, found by the entry point group `orchestrator.commands`.

Each unit that can be verified adds its own parser through the entry points of `VERIFICATIONS`.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import add_installed, command
from orchestrator.cli.outcome import Outcome
from orchestrator.installed import entry_points

VERIFICATIONS: Final = "orchestrator.verifications"
"""Entry points by the name of the unit: a callable that adds the unit's parser to the subparsers of
`verify`, with the default `execute`, a callable from the parsed arguments to an `Outcome`."""


def add_command(commands: Any) -> None:
    """Add `verify` to the subparsers of the command line."""
    verify = commands.add_parser("verify", help="compare a unit with data or theory from elsewhere")
    units = verify.add_subparsers(dest="unit", required=True, metavar="UNIT")
    add_installed(units, entry_points(group=VERIFICATIONS), "`verify {}`")


def unit_parser(
    units: Any,
    name: str,
    *,
    summary: str,
    title: str,
    epilog: str,
    execute: Callable[[argparse.Namespace], Outcome],
    page: str,
) -> argparse.ArgumentParser:
    """The parser of a unit, with the options `--json` and `--figures`.

    Args:
        units: the subparsers of `verify`.
        name: of the unit.
        summary: for the list of units.
        title: above the options.
        epilog: below them.
        execute: what `verify` does with the unit.
        page: what is written beside the folder of the figures, for the help.
    """
    parser = command(
        units, name, summary, epilog, description=title, execute=execute, abbreviated=True
    )
    parser.add_argument(
        "--figures",
        type=Path,
        metavar="DIR",
        help=f"draw figures into DIR, and write the page {page} beside it",
    )
    return parser
