"""Measurements in a process of their own: with a SUMO and a peak of memory of its own."""

import multiprocessing
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, Final, ParamSpec

from benchmarks.benchmark import Measurement
from orchestrator.errors import CosimError

_P = ParamSpec("_P")
_STATUS: Final = Path("/proc/self/status")
_MIB_PER_KIB: Final = 1.0 / 1024.0


class MeasurementError(CosimError):
    """A measurement failed in its process. Exit code 2."""


def apart(work: Callable[_P, Measurement], *arguments: _P.args, **named: _P.kwargs) -> Measurement:
    """What `work` measures in a process that is started for it and ends after it.

    Args:
        work: a function of a module.
        arguments: of it; they can be pickled.
        named: of it, too.

    Raises:
        MeasurementError: `work` raised something, or its process died.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn) as pool:
        try:
            found = pool.submit(_attempt, work, arguments, named).result()
        except BrokenProcessPool as error:
            raise MeasurementError(f"the process of `{work.__name__}` died") from error
    if isinstance(found, str):
        raise MeasurementError(f"`{work.__name__}`: {found}")
    return found


def _attempt(
    work: Callable[..., Measurement], arguments: tuple[Any, ...], named: Mapping[str, Any]
) -> Measurement | str:
    """What was measured, or what was raised: not every error can be pickled."""
    try:
        return work(*arguments, **named)
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def peak_mib() -> Measurement:
    """`peak_mib`: the most memory that this process had at a time; only Linux tells.

    The most that one of the processes had which it started, and which have ended, is added.
    """
    if not _STATUS.is_file():
        return {}
    import resource  # noqa: PLC0415 - there is none for Windows

    lines = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines() if ":" in line)
    own = int(lines["VmHWM"].split()[0])
    started = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return {"peak_mib": (own + started) * _MIB_PER_KIB}
