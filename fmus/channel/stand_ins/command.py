"""`nlosim trace`, found by the entry point group `orchestrator.commands`."""

import argparse
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

from orchestrator.cli.command import command
from orchestrator.cli.outcome import Outcome

_EPILOG = """\
The file can be replayed by a component of the type `channel-trace`:

  per      packet error rate of every link in every bin of time (default)
  outcome  what became of every frame at every receiver; with the same packets, a replay with
           `tolerance: 0 s` repeats the run

examples:
  nlosim trace runs/red_light-1 --out links.csv
  nlosim trace runs/red_light-1 --out links.csv --bin 1 --no-power
  nlosim trace runs/red_light-1 --out links.csv --kind outcome"""


def add_command(commands: Any) -> None:
    """Add `trace` to the subparsers of the command line."""
    summary = "make a file of recorded links from a run"
    title = "Make a file of recorded links from a finished run."
    trace = command(commands, "trace", summary, _EPILOG, description=title, execute=execute)
    trace.add_argument("directory", type=Path, metavar="RUN_DIR", help="a run directory")
    trace.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="*.csv, or *.parquet"
    )
    trace.add_argument("--kind", choices=("per", "outcome"), default="per", help="see below")
    trace.add_argument(
        "--bin",
        type=_positive_seconds,
        default="0.1",
        metavar="SECONDS",
        help="over which frames are counted for one error rate (default: 0.1)",
    )
    trace.add_argument(
        "--between", type=_vehicles, default=(), metavar="ID,ID,...", help="only these vehicles"
    )
    trace.add_argument(
        "--no-power",
        action="store_true",
        help="leave out powers and link classes, and with them error rates\nthat do not change",
    )
    trace.add_argument("--component", default="channel", metavar="NAME", help="default: channel")


def execute(arguments: argparse.Namespace) -> Outcome:
    """Read the recording and write the file."""
    from fmus.channel.stand_ins import recorded  # noqa: PLC0415 - NumPy takes a while
    from orchestrator.recording import Recording  # noqa: PLC0415

    events = recorded.Events.of(
        Recording(arguments.directory), arguments.component, arguments.between
    )
    with_power = not arguments.no_power
    columns = (
        recorded.outcomes(events, with_power=with_power)
        if arguments.kind == "outcome"
        else recorded.error_rates(events, arguments.bin, with_power=with_power)
    )
    recorded.write(columns, arguments.out, _remark(arguments))
    links = set(zip(columns["transmitter"], columns["receiver"], strict=True))
    return Outcome(
        text=f"{arguments.out}: {len(columns['time'])} rows of {len(links)} links",
        data={"out": str(arguments.out), "rows": len(columns["time"]), "links": len(links)},
    )


def _remark(arguments: argparse.Namespace) -> str:
    """The command that makes the file again."""
    words = ["nlosim", "trace", str(arguments.directory), "--out", arguments.out.name]
    words += ["--kind", arguments.kind]
    if arguments.kind == "per":
        words += ["--bin", f"{Decimal(arguments.bin).scaleb(-9).normalize():f}"]
    if arguments.between:
        words += ["--between", ",".join(map(str, arguments.between))]
    words += ["--no-power"] if arguments.no_power else []
    words += [] if arguments.component == "channel" else ["--component", arguments.component]
    return " ".join(words)


def _positive_seconds(text: str) -> int:
    """Nanoseconds of the seconds in `text`."""
    try:
        exact = Decimal(text).scaleb(9)
    except InvalidOperation:
        exact = Decimal(0)
    if not exact.is_finite() or exact <= 0 or exact != int(exact):
        raise argparse.ArgumentTypeError(
            f"`{text}` is no positive number of seconds, a whole number of nanoseconds"
        )
    return int(exact)


def _vehicles(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"`{text}` is no list of numbers of vehicles, as in 3,17"
        ) from None
