"""What Dask does first in each worker process of this machine (a `preload` module)."""

import signal


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C, which a terminal sends to every process, to the one that conducts."""
    del worker
    signal.signal(signal.SIGINT, signal.SIG_IGN)
