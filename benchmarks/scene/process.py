"""Measurements in a process of their own: with a SUMO and a peak of memory of its own."""

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Final, ParamSpec

from benchmarks.benchmark import Measurement

_P = ParamSpec("_P")
_STATUS: Final = Path("/proc/self/status")
_MIB_PER_KIB: Final = 1.0 / 1024.0


def apart(work: Callable[_P, Measurement], *arguments: _P.args, **named: _P.kwargs) -> Measurement:
    """What `work` measures in a process that is started for it and ends after it.

    Args:
        work: a function of a module.
        arguments: of it; they can be pickled.
        named: of it, too.

    Raises:
        Exception: whatever `work` raises.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn) as pool:
        return pool.submit(work, *arguments, **named).result()


def peak_mib() -> Measurement:
    """`peak_mib`, the most memory that this process had at a time; only Linux tells."""
    if not _STATUS.is_file():
        return {}
    lines = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines() if ":" in line)
    return {"peak_mib": int(lines["VmHWM"].split()[0]) * _MIB_PER_KIB}
