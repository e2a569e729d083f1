"""`nlosim ssp ...`, found by the entry point group `orchestrator.commands`.

What the actions do is loaded when they are called.
"""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import command
from orchestrator.cli.outcome import Outcome

_IMPORT: Final = """\
Writes FOLDER with a scenario file and the FMUs of the package. Nested systems become one level of
components, connections through their connectors become connections of components, parameter sets
become parameters and start values; a comment at each line says which place of the package says it.
What a scenario has no place for is told, with its place; what cannot be used at all is an error,
and then nothing is written. Nothing of the FMUs is run. Exit code 1 if the scenario cannot run as
it is, which `nlosim check` would say, too.

SSP has no step sizes: the one that OMSimulator has noted down counts, else the shortest step of the
FMUs, else there are 500 steps.

  nlosim ssp import car.ssp
  nlosim ssp import car.ssp -o car --system Winter --step 0.001
  nlosim run car/car.yaml
"""

_EXPORT: Final = """\
Writes a scenario whose components are FMUs as a package that other tools read: the FMUs,
connections with gain, offset and units, parameters, start values and constants, start and stop.
What SSP has no words for (step sizes, coupling, seed, recording, measures, delays) is written as
notes that nlosim reads and others pass over; OMSimulator finds the step size where it looks for it.
What cannot be said at all (components that are no FMUs, sums, elements of arrays) is an error with
its line.

  nlosim ssp export model.yaml
  nlosim ssp export model.yaml -o model.ssp --version 2.0
"""


def add_command(commands: Any) -> None:
    """Add `ssp` to the subparsers of the command line."""
    ssp = commands.add_parser("ssp", help="scenarios from SSP packages, and SSP packages of them")
    actions = ssp.add_subparsers(dest="action", required=True, metavar="ACTION")
    summary = "a scenario from an SSP package, 1.0 or 2.0"
    reader = command(actions, "import", summary, _IMPORT, execute=_import)
    reader.add_argument("path", type=Path, metavar="SSP", help="an .ssp file")
    reader.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="default: the name of the package, here"
    )
    reader.add_argument(
        "--system", metavar="NAME", help="another description than SystemStructure.ssd"
    )
    reader.add_argument(
        "--trust-numbers",
        action="store_true",
        help="take numbers whose unit nothing defines as they are (default: an error)",
    )
    for name, what in (
        ("stop-time", "the last communication point [s]"),
        ("step", "the communication step size of all components [s]"),
    ):
        reader.add_argument(f"--{name}", metavar="SECONDS", help=what)
    summary = "an SSP package of a scenario whose components are FMUs"
    writer = command(actions, "export", summary, _EXPORT, execute=_export)
    writer.add_argument(
        "scenario", metavar="SCENARIO", help="a scenario file, or the name of an installed one"
    )
    writer.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="default: the name of the scenario, here"
    )
    writer.add_argument(
        "--version",
        choices=("1.0", "2.0"),
        default="1.0",
        help="of SSP; arrays take 2.0 (default: %(default)s, which more tools read)",
    )


def _import(arguments: argparse.Namespace) -> Outcome:
    from adapters.ssp.command.importing import imported  # noqa: PLC0415 - the help needs no XML

    return imported(arguments)


def _export(arguments: argparse.Namespace) -> Outcome:
    from adapters.ssp.command.exporting import exported  # noqa: PLC0415

    return exported(arguments)
