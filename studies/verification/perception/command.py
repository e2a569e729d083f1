"""`nlosim verify perception`, found by the entry point group `orchestrator.verifications`."""

import argparse
import importlib.util
from typing import Any, Final

from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from studies.verification.command import unit_parser

SCENES: Final = 500
"""Scenes unless the user says otherwise."""

_EPILOG: Final = """\
Scenes are drawn from the seed: junctions and streets, houses, queues and moving traffic, an ego
vehicle that approaches with a planned route, and 2 to 10 equipped vehicles near it. In each, the
lidar and the perception FMU that are installed scan, exchange all their matrices, and choose a
sharer. What is hidden in truth, and what each candidate reveals of it, follows from exact shadows.

The targets, by the recommended parameters:
  in 95 % of the scenes in which a candidate reveals 25 m^2 or more, the chosen sharer reveals
  95 % of what the best one does;
  all matrices, the request and the sharer's features in the blind zones take 5 % of the bytes
  that features of all would take

columns:
  best       share of these scenes in which the best sharer was chosen
  right      one that reveals 95 % of what the best one does
  revealed   mean share of what the best one reveals
  missed     nobody was chosen;  false: somebody was, of the scenes in which nobody reveals 5 m^2
  precision, recall, IoU of the blind zones against the hidden road

Ctrl-C prints the scenes played until then. Exit codes:
  0  both targets are met
  1  one is not; the last two lines say which
  2  the command line is wrong, or the extra is missing: pip install 'nlosim[verify]'

examples:
  nlosim verify perception --scenes 20
  nlosim verify perception --seed 7 --json
  nlosim verify perception --figures docs/validation-perception"""


def add_unit(units: Any) -> None:
    """Add `perception` to the subparsers of `nlosim verify`."""
    parser = unit_parser(
        units,
        "perception",
        summary="blind zones and sharers of the perception FMU against geometry",
        title="Compare blind zones and chosen sharers with exact visibility.",
        epilog=_EPILOG,
        execute=execute,
        page="DIR.md",
    )
    parser.add_argument(
        "--scenes",
        type=_count,
        default=SCENES,
        metavar="N",
        help=f"how many scenes (default: {SCENES}, about a quarter of an hour)",
    )
    parser.add_argument(
        "--seed", type=_seed, default=1, metavar="S", help="of the scenes (default: 1)"
    )


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 on, not `{text}`")
    return int(text)


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number from 0 on, not `{text}`")
    return int(text)


def execute(arguments: argparse.Namespace) -> Outcome:
    """Play, compare, and draw."""
    missing = [name for name in ("shapely", "asn1tools") if importlib.util.find_spec(name) is None]
    if missing:
        return failure(
            "input",
            Exit.WRONG_INPUT,
            f"{' and '.join(missing)} must be installed: pip install 'nlosim[verify]'",
        )
    # imported here, so that `nlosim --help` need not wait for NumPy and shapely
    from orchestrator import registry  # noqa: PLC0415
    from studies.verification.perception.parameter_set import all_sets  # noqa: PLC0415
    from studies.verification.perception.session import UnitsUnderTest  # noqa: PLC0415
    from studies.verification.perception.tables import as_text  # noqa: PLC0415
    from studies.verification.perception.verification import verify  # noqa: PLC0415

    units = UnitsUnderTest(registry.component_type("lidar"), registry.component_type("perception"))
    with stopping():  # SIGTERM, too, is Ctrl-C
        found = verify(units, seed=arguments.seed, scenes=arguments.scenes, sets=all_sets())
    text, data = as_text(found), found.as_data()
    if not found.is_complete:
        code = Exit.INTERRUPTED
        error = {"kind": "interrupted", "exit_code": int(code), "message": "interrupted"}
        text += "\ninterrupted: these are the scenes played until then"
        return Outcome(text=text, data={**data, "error": error}, exit_code=code)
    if arguments.figures is not None:
        from studies.verification.perception.page import write_page  # noqa: PLC0415

        text += f"\nwrote {write_page(found, arguments.figures)}"
    return Outcome(text=text, data=data, exit_code=Exit.DONE if found.passes else Exit.NOT_PASSED)
