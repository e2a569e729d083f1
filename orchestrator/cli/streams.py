"""Standard output and standard error: closed, full, or unable to write every character."""

import io
import json
import logging
import os
import sys
from contextlib import suppress
from typing import Final, TextIO

from orchestrator.cli.outcome import Exit, Outcome

_DESCRIPTORS: Final = (0, 1, 2)


def prepare() -> None:
    """Make the standard streams fit to be written to, whatever they were when the process began.

    What is closed leads nowhere: else the next file that is opened would take its place, and get
    what libraries print. Characters that the encoding of a stream lacks are written as escapes.
    What a log cannot take is lost without another word.
    """
    for descriptor in _DESCRIPTORS:
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    logging.raiseExceptions = False


def tell_line(line: str) -> None:
    """Write a line for people to standard error, while a command goes on."""
    with suppress(OSError):  # the terminal may be gone
        sys.stderr.write(f"{line}\n")


def tell(outcome: Outcome, *, is_json: bool) -> int:
    """Write what a command came to.

    Args:
        outcome: of the command.
        is_json: whether one JSON object is wanted.

    Returns:
        The exit code: that of the outcome, or 2 if all went well and cannot be told. That nobody
        reads on (`nlosim components | head`) is no error.
    """
    is_error = "error" in outcome.data
    told = True
    if is_json:
        told &= _write(sys.stdout, json.dumps(outcome.data, indent=2, allow_nan=False) + "\n")
    if outcome.text and (is_error or not is_json):
        told &= _write(sys.stderr if is_error else sys.stdout, outcome.text + "\n")
    return int(outcome.exit_code) or (0 if told else int(Exit.WRONG_INPUT))


def flush() -> bool:
    """Write what waits in standard output; whether that is possible."""
    return _write(sys.stdout, "")


def _write(stream: TextIO, text: str) -> bool:
    try:
        stream.write(text)
        stream.flush()
    except BrokenPipeError:
        _drop(stream)
    except OSError as error:
        _drop(stream)
        if stream is not sys.stderr:
            _write(sys.stderr, f"error: cannot write to standard output: {error.strerror}\n")
        return False
    return True


def _drop(stream: TextIO) -> None:
    """Let nothing more be written to `stream`, also not what is in it when the process ends."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        stream.flush()
