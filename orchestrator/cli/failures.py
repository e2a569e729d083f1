"""From an exception to what the user reads: one clear message, never a traceback."""

import os
import tempfile
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.parser import UsageError
from orchestrator.cli.shortage import is_shortage
from orchestrator.errors import (
    ComponentError,
    CosimError,
    PluginError,
    Problem,
    ScenarioError,
    in_words,
)
from orchestrator.log import LOG

OURS: Final = frozenset(
    {"", "adapters", "benchmarks", "fmus", "orchestrator", "scenarios", "studies"}
)
"""Top of the names of our own modules: if one of them is missing, that is a bug."""


def usage(error: UsageError) -> Outcome:
    """The command line is wrong."""
    return failure("usage", Exit.WRONG_INPUT, str(error), text=f"{error.usage}error: {error}")


def outcome_of(error: BaseException, directory: Path | None = None) -> Outcome:
    """The outcome of a command that raised `error`.

    Args:
        error: whatever it was.
        directory: of the run, if there is one.
    """
    where = {} if directory is None else {"out": str(directory)}
    recorded = "" if directory is None else f"\nrecorded until then: {directory}"
    match error:
        case ScenarioError():
            return _problems(error)
        case PluginError() if not is_shortage(error):
            return plugin_failed(error, directory)
        case ComponentError():
            return failure(
                "component",
                Exit.COMPONENT_FAILED,
                str(error),
                text=f"error: {error}{_raised(error, directory)}{recorded}",
                component=error.component,
                time_s=None if error.time is None else error.time / 1e9,
                **({"raised_at": error.where} if error.where else {}),
                **where,
            )
        case KeyboardInterrupt():
            text = f"interrupted{recorded}"
            return failure("interrupted", Exit.INTERRUPTED, "interrupted", text=text, **where)
        case Exception() if is_shortage(error) or isinstance(error, CosimError | OSError):
            return _wrong_input(error, recorded, where)
        case _:
            lacking = _lacking(error, recorded)
            return lacking or bug(f"internal error: {in_words(error)}", error, directory)


def _wrong_input(error: Exception, recorded: str, where: Mapping[str, str]) -> Outcome:
    """Something is wrong out there: a full disk or a wrong path is no bug of ours."""
    if is_shortage(error):
        why = f": {said(error)}" if str(error) else ""
        text = f"there is not enough memory for this{why}{recorded}"
        return failure("memory", Exit.WRONG_INPUT, text, **where)
    text = f"error: {said(error)}{recorded}"
    return failure("input", Exit.WRONG_INPUT, said(error), text=text, **where)


def stopped_short(cause: OSError, out: Path, command: str) -> Outcome:
    """The machine does not let a campaign go on, as with a full disk.

    Args:
        cause: what the operating system said.
        out: where the finished part of the campaign is.
        command: that goes on once it can.
    """
    text = f"error: {said(cause)}\nwhat is finished is in {out}; once the cause is mended, "
    text += f"go on with: {command}"
    return failure("input", Exit.WRONG_INPUT, said(cause), text=text, out=str(out))


def plugin_failed(error: PluginError, directory: Path | None, text: str = "") -> Outcome:
    """A measure, a report or a command of an installed package failed; its traceback is kept.

    Args:
        error: that names it.
        directory: of the run, if there is one.
        text: what is said of it; what the error says, unless there is more.
    """
    log = _traceback_file(error, directory)
    raised = f"\nraised at {error.where}" if error.where else ""
    recorded = "" if directory is None else f"\nrecorded in: {directory}"
    return failure(
        "plugin",
        Exit.COMPONENT_FAILED,
        text or str(error),
        text=f"error: {text or error}{raised}\ntraceback: {log}{recorded}",
        log=str(log),
        **({"raised_at": error.where} if error.where else {}),
        **({} if directory is None else {"out": str(directory)}),
    )


def _traceback_file(error: BaseException, directory: Path | None) -> Path:
    """Where the traceback of `error` is, which the log of a run has."""
    return _write_traceback(error) if directory is None else directory / LOG


def _lacking(error: BaseException, recorded: str) -> Outcome | None:
    """What to do if a module of others is missing; `None` if it is nothing of that kind."""
    module = (error.name or "") if isinstance(error, ModuleNotFoundError) else ""
    if module.partition(".")[0] in OURS:
        return None
    what = f"the module `{module}` is missing, which this version needs; install it again"
    text = f"error: {what}: `pip install --upgrade nlosim`, in a checkout `pip install .`"
    return failure("installation", Exit.WRONG_INPUT, what, text=f"{text}{recorded}")


def _raised(error: ComponentError, directory: Path | None) -> str:
    """Which line of a component's code raised an exception, and where its traceback is."""
    if not error.where:
        return ""
    log = "" if directory is None else f"\ntraceback: {directory / LOG}"
    return f"\nraised at {error.where}{log}"


def said(error: BaseException) -> str:
    """What it says; of a file, its path and what is wrong with it."""
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    return error.strerror if error.filename is None else f"`{error.filename}`: {error.strerror}"


def _problems(error: ScenarioError) -> Outcome:
    count = len(error.problems)
    noun = "problem" if count == 1 else "problems"
    return failure(
        "scenario",
        Exit.WRONG_INPUT,
        f"{count} {noun} in the scenario",
        text="\n".join(map(str, error.problems)),
        problems=[problem_data(problem) for problem in error.problems],
    )


def problem_data(problem: Problem) -> dict[str, Any]:
    """A problem as `nlosim check --json` prints it."""
    where = problem.where
    return {
        "file": where.file,
        "line": where.line,
        "column": where.column,
        "message": problem.what,
    }


def bug(message: str, error: BaseException, directory: Path | None) -> Outcome:
    """The outcome after something that should not happen; the traceback goes to a file.

    If memory was short, it is none of ours.

    Args:
        message: what happened.
        error: its traceback is written, unless there is a run directory: its log has it.
        directory: of the run, if there is one.
    """
    if is_shortage(error):
        where = {} if directory is None else {"out": str(directory)}
        return failure(
            "memory", Exit.WRONG_INPUT, f"{message}: there is not enough memory", **where
        )
    log = _traceback_file(error, directory)
    return failure(
        "internal",
        Exit.INTERNAL_ERROR,
        message,
        text=f"{message}\nthis is a bug, please report it together with {log}",
        log=str(log),
        **({} if directory is None else {"out": str(directory)}),
    )


def _write_traceback(error: BaseException) -> Path:
    number, name = tempfile.mkstemp(prefix="nlosim-error-", suffix=".txt")
    os.close(number)
    log = Path(name)
    log.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    return log
