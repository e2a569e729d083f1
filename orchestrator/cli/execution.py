"""From arguments to an exit code."""

import contextlib
import importlib
import os
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from orchestrator.blame import blamed
from orchestrator.cli import failures, streams
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.cli.parser import UsageError, parser
from orchestrator.cli.requests import heard_by_exception, heard_no_more
from orchestrator.cli.shortage import explained, too_little
from orchestrator.cli.watch import WATCH, is_watched, watched

_MODULES: Final = {
    "run": "orchestrator.cli.run",
    "resume": "orchestrator.cli.resume",
    "rerun": "orchestrator.cli.rerun",
    "serve": "orchestrator.cli.serve",
    "check": "orchestrator.cli.check",
    "graph": "orchestrator.cli.graph",
    "components": "orchestrator.cli.components",
    "schema": "orchestrator.cli.schema",
    "completion": "orchestrator.cli.completion",
    "scenarios": "orchestrator.cli.scenarios",
    "report": "orchestrator.cli.report",
    "tap": "orchestrator.cli.tap",
    "experiment": "orchestrator.cli.experiment",
}
"""One module per command, with a function `execute(arguments) -> Outcome`. They are imported
when they are asked for, so that `nlosim --help` need not wait for NumPy."""


def execute(argv: Sequence[str] | None) -> int:
    """Run one command; see `orchestrator.cli.main`."""
    if argv is None:
        streams.prepare()
    given = sys.argv[1:] if argv is None else list(argv)
    is_json = "--json" in given
    ended = watched() if argv is None and is_watched(given) else None
    if isinstance(ended, int):
        return ended
    if ended is not None:
        return streams.tell(explained(ended), is_json=is_json)
    try:
        return _executed(given, is_program=argv is None, is_json=is_json)
    finally:
        WATCH.end()


def _executed(given: Sequence[str], *, is_program: bool, is_json: bool) -> int:
    """Run a command in this process."""
    try:
        with _output_kept_for_json() if is_json else contextlib.nullcontext():
            outcome = _outcome(given, is_program=is_program)
    except SystemExit:  # the help or the version was printed
        if streams.flush():
            raise
        return int(Exit.WRONG_INPUT)
    return streams.tell(explained(outcome), is_json=is_json)


def _outcome(given: Sequence[str], *, is_program: bool) -> Outcome:
    try:
        # ends the process after the help or the version
        arguments = parser(given).parse_args(given)
    except UsageError as error:
        return failures.usage(error)
    if (hopeless := too_little()) is not None:
        return hopeless
    try:
        if is_program:
            heard_by_exception()
        outcome: Outcome = _execute(arguments)(arguments)
    except BaseException as error:  # every error becomes a message and an exit code
        outcome = failures.outcome_of(error)
    if is_program:
        heard_no_more()
    return outcome


def _execute(arguments: Namespace) -> Callable[[Namespace], Outcome]:
    """The function of the command: one of ours, or that of an installed package."""
    if arguments.command in _MODULES:
        execute: Callable[[Namespace], Outcome]
        execute = importlib.import_module(_MODULES[arguments.command]).execute
        return execute
    found: Callable[[Namespace], Outcome] = arguments.execute
    if arguments.origin.partition(".")[0] in failures.OURS:
        return found

    def named(arguments: Namespace) -> Outcome:
        with blamed(f"the command `{arguments.command}` of `{arguments.origin}`"):
            return found(arguments)

    return named


@contextlib.contextmanager
def _output_kept_for_json() -> Iterator[None]:
    """Send what libraries print, from Python or from C, to standard error."""
    sys.stdout.flush()
    saved = os.dup(1)
    try:
        os.dup2(2, 1)
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)
