"""Too little memory: what it looks like, and the limit that may be why.

A limit of the address space (`ulimit -v`, `RLIMIT_AS`) counts what is only reserved, too: code of
libraries, stacks of threads, pools. Whoever meets it first fails in its own way: a library cannot
be mapped, a thread cannot be started, native code takes a null pointer for memory, or ends the
process. The words for all of these name the limit.
"""

import errno
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import in_words

if sys.platform != "win32":
    import resource

LEAST: Final = 128 << 20
"""Address space without which not even NumPy can be loaded; its BLAS ends the process [byte]."""

_WORDS: Final = (
    "failed to map segment from shared object",
    "cannot allocate memory",
    "can't start new thread",
)
_SUSPECT: Final = (*_WORDS, "was killed by sig", "out of memory")
_UNSAID: Final = "without exception set"
"""What a `MemoryError` leaves where C code of CPython finds no memory for it (`SystemError`)."""

_MEGABYTE: Final = 1 << 20


def address_space() -> int | None:
    """What this process may have [byte]; `None` if there is no limit."""
    if sys.platform == "win32":
        return None
    allowed, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if allowed == resource.RLIM_INFINITY else allowed


def is_shortage(error: BaseException) -> bool:
    """Whether an exception says that memory is short, itself or by what caused it.

    An error that C code did not say is one where the address space has a limit; elsewhere it is a
    bug, ours or of a library.
    """
    return any(
        isinstance(each, MemoryError)
        or (isinstance(each, OSError) and each.errno == errno.ENOMEM)
        or (isinstance(each, SystemError) and _UNSAID in str(each) and address_space() is not None)
        or any(words in in_words(each).lower() for words in _WORDS)
        for each in _chain(error)
    )


def _chain(error: BaseException) -> Iterator[BaseException]:
    found: BaseException | None = error
    while found is not None:
        yield found
        found = found.__cause__ or found.__context__


def too_little() -> Outcome | None:
    """What there is to say if no command can work with this limit; `None` otherwise."""
    allowed = address_space()
    if allowed is None or allowed >= LEAST:
        return None
    text = (
        f"this process may have {_amount(allowed)} of address space (`ulimit -v`); nlosim needs "
        f"{_amount(LEAST)} at the very least, and most scenarios 1 GB or more"
    )
    return failure("memory", Exit.WRONG_INPUT, text, address_space=allowed)


def explained(outcome: Outcome) -> Outcome:
    """What a command came to, with the limit if that may be the reason for a failure."""
    allowed, error = address_space(), outcome.data.get("error")
    if allowed is None or error is None or "address_space" in error:
        return outcome
    is_suspect = (
        error["kind"] == "memory"
        or outcome.exit_code in {Exit.COMPONENT_FAILED, Exit.INTERNAL_ERROR}
        or any(words in outcome.text.lower() for words in _SUSPECT)
    )
    if not is_suspect:
        return outcome
    note = (
        f"note: this process may have {_amount(allowed)} of address space (`ulimit -v`), which "
        "may be why; libraries reserve more than they use"
    )
    data = {**outcome.data, "error": {**error, "address_space": allowed}}
    return replace(outcome, text=f"{outcome.text}\n{note}", data=data)


def cut_short(how: str) -> Outcome | None:
    """What there is to say of a process that a limit may have ended; `None` without a limit.

    Args:
        how: it ended, as a predicate.
    """
    if address_space() is None:
        return None
    text = f"the process {how} before there was a run"
    return explained(failure("memory", Exit.WRONG_INPUT, text))


def _amount(size: int) -> str:
    return f"{size / _MEGABYTE:.0f} MB"
