"""Cases in processes that may crash, hang or eat memory: whatever happens is put down to its case.

A process (`isolation_main.py`) imports what is needed, and makes a copy of itself (`fork`) for
every few cases, with bounds of time and memory. What cases leave behind dies with the copy.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from tests.reliability.area import Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What a case may take.

    Attributes:
        seconds: wall time [s].
        megabytes: memory of a process [MB].
        together: how many cases share a process; a crash still counts for one of them.
    """

    seconds: float
    megabytes: float
    together: int = 1


def isolated(
    performer: str, seed: int, numbers: Sequence[int], bounds: Bounds
) -> Iterator[Outcome]:
    """What becomes of cases, in their order.

    Args:
        performer: `MODULE:FUNCTION`; the function is called once with the seed and a folder, and
            returns what performs a case: from its number to its `Outcome`. It is asked for the
            kind of a case that did not come to its end by its attribute `kind`, if it has one.
        seed: of the cases.
        numbers: of the cases, ascending.
        bounds: of each; one that passes them is not as it should be.
    """
    with tempfile.TemporaryDirectory(prefix="reliability-") as folder:
        order = {
            "performer": performer,
            "seed": seed,
            **_written(numbers),
            "folder": folder,
            "seconds": bounds.seconds,
            "megabytes": bounds.megabytes,
            "together": bounds.together,
        }
        with subprocess.Popen(
            [sys.executable, "-m", "tests.reliability.isolation_main"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            text=True,
        ) as process:
            try:
                yield from _outcomes(process, order, len(numbers))
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)


def _written(numbers: Sequence[int]) -> dict[str, Sequence[int]]:
    """Numbers for the process; millions of them as a range."""
    if isinstance(numbers, range):
        return {"range": (numbers.start, numbers.stop, numbers.step)}
    return {"numbers": list(numbers)}


def _outcomes(
    process: "subprocess.Popen[str]", order: Mapping[str, Any], expected: int
) -> Iterator[Outcome]:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(json.dumps(order))
    process.stdin.close()
    count = 0
    for line in process.stdout:
        yield Outcome(**json.loads(line))
        count += 1
    if process.wait() or count != expected:
        what = f"ended with {process.returncode} after {count} of {expected} cases"
        raise RuntimeError(f"the process of {order['performer']} {what}")
