"""What the commands of `nlosim` have in common, ours and those of installed packages."""

import argparse
import logging
from collections.abc import Callable, Iterable
from importlib.metadata import EntryPoint
from typing import Any

from orchestrator.cli.outcome import Outcome
from orchestrator.errors import defects, in_words

logger = logging.getLogger(__name__)


def seed(text: str) -> int:
    """The seed that an option says.

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 on, got {text!r}")
    return int(text)


def command(
    commands: Any,
    name: str,
    summary: str,
    details: str,
    *,
    description: str | None = None,
    execute: Callable[[argparse.Namespace], Outcome] | None = None,
    abbreviated: bool = False,
) -> argparse.ArgumentParser:
    """The parser of a command, which prints one JSON object if it is told to.

    Args:
        commands: subparsers that it is added to.
        name: of the command.
        summary: what it does, for the list of commands.
        details: below the arguments, with examples; printed as it is.
        description: above the arguments; the summary, unless there is more to say.
        execute: what the command does; `None` if whoever adds it looks that up.
        abbreviated: whether the names of its options may be cut short.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=description or f"{summary[0].upper()}{summary[1:]}.",
        epilog=details,
        formatter_class=argparse.RawTextHelpFormatter,
        allow_abbrev=abbreviated,
    )
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object, also after an error"
    )
    if execute is not None:
        parser.set_defaults(execute=execute)
    return parser


def add_installed(commands: Any, entries: Iterable[EntryPoint], called: str) -> None:
    """Add what installed packages offer; of a broken one nothing is left but a warning.

    The parsed arguments of a command have the module that offers it as `origin`.

    Args:
        commands: subparsers that each is added to.
        entries: callables that add parsers to the subparsers.
        called: what the warning calls one, a format of its name.
    """
    for entry in sorted(entries, key=lambda entry: entry.name):
        known = set(commands.choices)
        try:
            entry.load()(commands)
        except defects() as error:  # a broken plug-in must not take the other commands away
            reason = in_words(error)
            what = called.format(entry.name)
            logger.warning("%s (%s) cannot be loaded: %s", what, entry.value, reason)
        for name in commands.choices.keys() - known:
            commands.choices[name].set_defaults(origin=entry.value.partition(":")[0])
