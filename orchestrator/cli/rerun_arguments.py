"""The arguments of `nlosim rerun`, and of leaving out where a run was."""

import argparse
from typing import Any, Final

from orchestrator.cli.command import command

PRIVATE: Final = """\
write neither host name nor absolute paths into the files of the run; see docs/rerun.md"""

_RERUN: Final = """\
The manifest has all that repeats a run: the scenario with every parameter, seed and options, and
the digest of each file that it read. The files are looked for where they were, in the same place
relative to the scenario, and among installed packages; with --inputs first in that folder, also
under other names. Then the run is made again, in a directory of its own, and every sample of every
signal compared. See docs/rerun.md. Exit codes:
  0  every byte is the same
  1  it is not; the first signal, element and time that differ are named
  2  the run cannot be repeated here; each file that is missing or has another content is named

examples:
  nlosim rerun runs/red_light-1
  nlosim rerun published/run --inputs published/inputs --json"""


def add_rerun(commands: Any) -> None:
    """Add `rerun` to the subparsers of the command line."""
    rerun: argparse.ArgumentParser = command(
        commands, "rerun", "repeat a run, and say whether the bytes agree", _RERUN
    )
    rerun.add_argument("directory", metavar="DIR", help="of a run; its manifest.json is enough")
    rerun.add_argument(
        "--inputs", metavar="FOLDER", help="where the files are that the run read, at any depth"
    )
    rerun.add_argument(
        "--out",
        metavar="DIR",
        help="of the new run, new or empty (default: DIR-rerun, numbered if it exists)",
    )
    rerun.add_argument("--anyway", action="store_true", help="also with inputs of another content")
    rerun.add_argument(
        "--transport", metavar="NAME", help="as of `nlosim run` (default: as the run was asked for)"
    )
    rerun.add_argument("--private", action="store_true", help=PRIVATE)
    rerun.add_argument("--quiet", action="store_true", help="no progress bar, no warnings")
