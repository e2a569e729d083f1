"""Processes that work all the time, so that others hardly get a processor."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

NICE: Final = 19

_ENDLESS: Final = f"import os; os.nice({NICE})\nwhile True: pass"


@contextmanager
def company(count: int) -> Iterator[None]:
    """So many of them while the block runs, at nice 19."""
    busy = [subprocess.Popen([sys.executable, "-c", _ENDLESS]) for _ in range(count)]
    try:
        yield
    finally:
        for each in busy:
            each.kill()
            each.wait()
