"""The command line, `nlosim`; the only place that prints."""

import os
import sys
from collections.abc import Sequence

from orchestrator import leaving
from orchestrator.cli.requests import heard_at_once

# One thread per process: components are parallel to each other, and the order in which threads
# sum would show in the last bits. Must be set before the first import of NumPy.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: the arguments without the program's name; those of the process if `None`.

    Returns:
        The exit code; see `orchestrator.cli.outcome.Exit`.
    """
    if argv is None:
        leaving.prepare()
        heard_at_once(is_json="--json" in sys.argv)
    from orchestrator.cli.execution import execute  # noqa: PLC0415 - takes a while

    code = execute(argv)
    return leaving.ends_with(code) if argv is None else code
