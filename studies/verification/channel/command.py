"""`nlosim verify channel`, found by the entry point group `orchestrator.verifications`."""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.outcome import Exit, Outcome, failure
from studies.verification.command import unit_parser

_FEWEST_SEEDS: Final = 10
_EPILOG: Final = """\
Every file of DIR whose format is known goes through the channel FMU that is installed. Exit codes:
  0  all results lie within their tolerances
  1  some do not; the table says which
  2  golden data are malformed; all problems are printed as FILE: PLACE: PROBLEM

examples:
  nlosim verify channel --golden golden/veins
  nlosim verify channel --golden golden/veins --json
  nlosim verify channel --golden golden/veins --figures docs/validation"""


def add_unit(units: Any) -> None:
    """Add `channel` to the subparsers of `nlosim verify`."""
    channel = unit_parser(
        units,
        "channel",
        summary="the channel FMU against Veins",
        title="Compare the channel FMU with data that Veins produced.",
        epilog=_EPILOG,
        execute=execute,
        page="DIR-channel.md",
    )
    channel.add_argument(
        "--golden", type=Path, required=True, metavar="DIR", help="directory of golden data"
    )
    channel.add_argument(
        "--seeds",
        type=_seeds,
        default=20,
        metavar="N",
        help="how often runs of the whole stack are repeated with own medium\naccess (default: 20)",
    )


def _seeds(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if number < _FEWEST_SEEDS:
        raise argparse.ArgumentTypeError(
            f"must be {_FEWEST_SEEDS} or more, not `{text}`: the spread of fewer says little"
        )
    return number


def execute(arguments: argparse.Namespace) -> Outcome:
    """Compare, and draw."""
    # imported here, so that `nlosim --help` need not wait for NumPy and Matplotlib
    from orchestrator import registry  # noqa: PLC0415
    from studies.verification.channel.golden_files import GoldenError  # noqa: PLC0415
    from studies.verification.channel.session import ChannelUnderTest  # noqa: PLC0415
    from studies.verification.channel.verification import (  # noqa: PLC0415
        as_text,
        read_golden_set,
        verify,
    )

    try:
        golden = read_golden_set(arguments.golden, arguments.seeds)
    except GoldenError as error:
        return failure(
            "golden",
            Exit.WRONG_INPUT,
            f"{len(error.problems)} problem(s) in golden data",
            text="\n".join(error.problems),
            problems=list(error.problems),
        )
    channel = ChannelUnderTest(registry.component_type("channel"))
    verification = verify(channel, golden)
    text = as_text(verification)
    if arguments.figures is not None:
        from studies.verification.channel.page import write_page  # noqa: PLC0415

        page = write_page(verification, arguments.golden, arguments.figures, arguments.seeds)
        text += f"\nwrote {page}"
    return Outcome(
        text=text,
        data=verification.as_data(),
        exit_code=Exit.DONE if verification.passes else Exit.NOT_PASSED,
    )
