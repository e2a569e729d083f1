"""`nlosim verify`, found by the entry point group `orchestrator.commands`.

Each unit that can be verified adds its own parser through the entry points of `VERIFICATIONS`.
"""

import argparse
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import add_installed

VERIFICATIONS: Final = "orchestrator.verifications"
"""Entry points by the name of the unit: a callable that adds the unit's parser to the subparsers of
`verify`, with the default `execute`, a callable from the parsed arguments to an `Outcome`."""


def add_command(commands: Any) -> None:
    """Add `verify` to the subparsers of the command line."""
    verify = commands.add_parser("verify", help="compare a unit with data or theory from elsewhere")
    units = verify.add_subparsers(dest="unit", required=True, metavar="UNIT")
    add_installed(units, entry_points(group=VERIFICATIONS), "`verify {}`")


def add_figures(unit: argparse.ArgumentParser, page: str) -> None:
    """Add `--figures DIR`, which also writes `page` beside that folder, to the parser of a unit."""
    help_text = f"draw figures into DIR, and write the page {page} beside it"
    unit.add_argument("--figures", type=Path, metavar="DIR", help=help_text)
