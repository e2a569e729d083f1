"""The command line, `nlosim`; the only place that prints."""

import os

# One thread per process: components are parallel to each other, and the order in which threads
# sum would show in the last bits. Must be set before the first import of NumPy.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

from orchestrator.cli.main import main as main  # noqa: E402 - see above
