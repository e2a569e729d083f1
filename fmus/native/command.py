"""`nlosim fmu build`, found by the entry point group `orchestrator.fmu_actions`."""

import argparse
from typing import Any

from fmus.native.build import add_arguments, build_units
from fmus.native.check import InterfaceError
from fmus.native.targets import CompilerError
from orchestrator.cli.outcome import Exit, Outcome, failure


def add_action(actions: Any) -> None:
    """Add `build` to the subparsers of `nlosim fmu`."""
    maker = actions.add_parser("build", help="compile native units")
    add_arguments(maker)
    maker.add_argument("--json", action="store_true", help="print one JSON object")
    maker.set_defaults(execute=build)


def build(arguments: argparse.Namespace) -> Outcome:
    """Compile FMUs."""
    try:
        built = list(build_units(arguments))
    except (InterfaceError, CompilerError) as error:
        return failure("fmu", Exit.WRONG_INPUT, str(error))
    rows = [
        {"path": str(b.path), "bytes": b.path.stat().st_size, "seconds": b.seconds, "new": b.is_new}
        for b in built
    ]
    return Outcome(text="\n".join(map(str, built)), data={"fmus": rows})
