"""The arguments of `nlosim tap`."""

import argparse
import math
from typing import Any, Final

from orchestrator.cli.command import command

_TAP: Final = """\
Shows the outputs of a run that goes on, started with `nlosim run --tap`: how often each is
published (per simulated second), how old its value is, its course (of arrays: of their mean), and
the value (of arrays: the least and the largest element, and the shape). On a terminal the table is
drawn again and again; elsewhere it is printed once, at the end of the run or after --seconds.

Looking changes nothing and holds nothing up: a run spends at most 1 % of its time on it, and
whoever reads too slowly misses messages, which are counted. --record keeps what was shown, for
`nlosim tap FILE` and other programs (docs/wire-format.md); the run's own recording has everything.

examples:
  nlosim tap
  nlosim tap runs/red_light-1 'relay.*' policy.brake
  nlosim tap runs/red_light-1 --seconds 10 --record ten-seconds.tap
  nlosim tap ten-seconds.tap 'relay.*'"""


def add_tap(commands: Any) -> None:
    """Add `tap` to the subparsers of the command line."""
    tap = command(commands, "tap", "look at the signals of a run that goes on", _TAP)
    tap.add_argument(
        "run",
        metavar="RUN",
        nargs="?",
        help="a run directory, or a file that --record wrote (default: the newest run in runs/\n"
        "that can be looked at)",
    )
    tap.add_argument(
        "keys", metavar="KEY", nargs="*", help="outputs, `component.connector`; patterns (* ? [])"
    )
    tap.add_argument(
        "--rate",
        type=_rate,
        default=10.0,
        metavar="N",
        help="messages per second of wall time, 50 at most (default: 10)",
    )
    tap.add_argument(
        "--seconds", type=_seconds, metavar="S", help="look so long (default: to the end)"
    )
    tap.add_argument("--record", metavar="FILE", help="write what is shown to a new file")


def _rate(text: str) -> float:
    return _number(text, 50.0, "expected a number above 0 and at most 50")


def _seconds(text: str) -> float:
    return _number(text, math.inf, "expected a number of seconds above 0")


def _number(text: str, largest: float, expected: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value <= largest or math.isinf(value):
        raise argparse.ArgumentTypeError(f"{expected}, got `{text}`")
    return value
