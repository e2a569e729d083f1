"""Worker processes, by Dask: those of this machine, or those of a scheduler that is running."""

import contextlib
import importlib
import logging
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, Final, Protocol, TypeAlias

from typing_extensions import override

from orchestrator.campaign.deferral import deferred
from orchestrator.campaign.work import Result, RunKey, Work, perform
from orchestrator.errors import CosimError, in_words
from orchestrator.scratch import scratch

_PAUSE: Final = 1.0
"""How long to wait between two looks at workers that may have been given up [s]."""

_GONE: Final = frozenset({"closed", "failed"})
"""What Dask calls the states of workers that it has given up."""


class MissingExtraError(CosimError):
    """A package that only experiments need is not installed. Exit code 2."""


def require(module: str) -> Any:
    """Import a module of the extra `experiment`.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        what = f"experiments need `{package}`: pip install 'nlosim[experiment]'"
        raise MissingExtraError(what) from error


class Workers(Protocol):
    """Performs runs, each in a process that performs one at a time."""

    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        """Results as they come; what fails is tried a second time. Closing it cancels the rest."""
        ...


class DaskWorkers(Workers):
    """The workers of a Dask client.

    Args:
        client: a `distributed.Client`.
        scratch: where runs take place of which nothing is kept; `None`: in the temporary
            directories of the workers.
    """

    def __init__(self, client: Any, scratch: Path | None) -> None:
        self._client = client
        self._scratch = None if scratch is None else str(scratch)

    @override
    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        ordered = list(work)
        pending = dict(zip(self._submit([each for _, each in ordered]), ordered, strict=True))
        retried: set[RunKey] = set()
        completed = require("distributed").as_completed(list(pending))
        try:
            for future in completed:
                key, each = pending.pop(future)
                result = _result(future)
                if result.error is not None and key not in retried:
                    retried.add(key)
                    (again,) = self._submit([each])
                    pending[again] = (key, each)
                    completed.add(again)
                    continue
                yield key, result
        finally:
            self._client.cancel(list(pending), force=True)

    def _submit(self, work: Sequence[Work]) -> Sequence[Any]:
        # in one piece: one by one, Dask does not know at first that there will be more than the
        # workers can take, and puts two on each; the second waits if the worker starts slowly,
        # while the other workers are far ahead
        with_scratch = [replace(each, scratch=self._scratch) for each in work]
        # the same call twice is two runs: a retry must not find the result of the first
        futures: Sequence[Any] = self._client.map(perform, with_scratch, pure=False)
        return futures


Pool: TypeAlias = Callable[[], AbstractContextManager[Workers]]
"""Opens the workers; until it is called, and afterwards, the machine belongs to others."""


def _result(future: Any) -> Result:
    """What a finished future holds; a worker that died is a failed run."""
    if future.status == "finished":
        found: Result = future.result()
        return found
    error = future.exception() if future.status == "error" else None
    reason = "the run was cancelled by the scheduler"
    if error is not None:
        is_dead = type(error).__name__ == "KilledWorker"
        reason = "the worker process died" if is_dead else in_words(error)
    return Result(wall=0.0, fingerprint=None, metrics={}, error=reason)


@contextlib.contextmanager
def local_workers(count: int | None, scratch: Path) -> Iterator[Workers]:
    """Processes of this machine, one thread each.

    Args:
        count: how many; `None`: one per core.
        scratch: where Dask keeps its files.

    Raises:
        MissingExtraError: Dask is not installed.
        CosimError: the processes cannot be started, because of limits of the system perhaps.
    """
    distributed, dask = require("distributed"), require("dask")
    _silence()
    settings = {
        "temporary-directory": str(scratch),
        "distributed.scheduler.allowed-failures": 0,  # `results` tries again
        "distributed.scheduler.worker-saturation": 1.0,  # no queue dies with a worker
        "distributed.worker.preload": ["orchestrator.campaign.preload"],
        "distributed.worker.profile.enabled": False,
        # Dask has freed memory returned at once, only to be asked for again: arrays of every step
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
    }
    stack = contextlib.ExitStack()
    try:
        with deferred(), _deaf_to_interrupts(), _starting():
            stack.enter_context(dask.config.set(settings))
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=require("dask.system").CPU_COUNT if count is None else count,
                    threads_per_worker=1,
                    processes=True,
                    memory_limit=0,
                    dashboard_address=None,
                    # the port that Dask prefers may be another experiment's, of which it warns
                    scheduler_kwargs={"dashboard_address": ":0"},
                    local_directory=str(scratch),
                    silence_logs=logging.CRITICAL,
                )
            )
            client = stack.enter_context(distributed.Client(cluster))
            stack.enter_context(_replacing(cluster))
        yield DaskWorkers(client, scratch)
    finally:
        with deferred():
            stack.close()


@contextlib.contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start threads, and the processes that these start, that Ctrl-C does not reach.

    A terminal sends it to every process; the one that conducts acts on it. A worker that heard it
    before it can ignore it would say so with a traceback. On Windows processes have no such mask.
    """
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # it ends the mask of the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)  # one that came meanwhile is heard now


@contextlib.contextmanager
def _replacing(cluster: Any) -> Iterator[None]:
    """Replace workers that Dask gives up, as it does with those that die while they start.

    A worker gets a run before Dask has noticed that it is there; a run that ends its process at
    once ends it within this time. With all workers given up, nobody would do the rest.
    """
    count = len(cluster.workers)
    is_over = threading.Event()

    def look() -> None:
        while not is_over.wait(_PAUSE):
            given_up = [k for k, nanny in cluster.workers.items() if nanny.status.name in _GONE]
            for name in given_up:
                cluster.worker_spec.pop(name, None)
            if given_up or len(cluster.workers) < count:
                cluster.scale(count)  # makes those that it has not

    watch = threading.Thread(target=look, name="workers given up", daemon=True)
    watch.start()
    try:
        yield
    finally:
        is_over.set()
        watch.join()


@contextlib.contextmanager
def _starting() -> Iterator[None]:
    """Say of Dask's workers that they do not start; it waits for them for half a minute."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise CosimError(f"the worker processes cannot be started: {error}") from error


@contextlib.contextmanager
def local_pool(count: int | None, name: str) -> Iterator[Workers]:
    """Processes of this machine, and a folder in which they write.

    Args:
        count: how many; `None`: one per core.
        name: of the campaign's kind, for that of the folder.

    Raises:
        MissingExtraError: Dask is not installed.
    """
    with scratch(name) as folder, local_workers(count, folder) as workers:
        yield workers


@contextlib.contextmanager
def scheduled_workers(address: str) -> Iterator[Workers]:
    """The workers of a scheduler that is running.

    Args:
        address: `tcp://HOST:PORT`.

    Raises:
        MissingExtraError: Dask is not installed.
        CosimError: no scheduler answers there, or it has no workers, or they have more threads.
    """
    distributed = require("distributed")
    _silence()
    try:
        client = distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise CosimError(f"no Dask scheduler answers at `{address}`: {error}") from error
    with client:
        threads = set(client.nthreads().values())
        if not threads:
            raise CosimError(f"the Dask scheduler at `{address}` has no workers yet")
        if threads != {1}:
            what = f"workers at `{address}` have {max(threads)} threads; SUMO needs a process each"
            raise CosimError(f"{what}: start them with `dask worker --nthreads 1`")
        yield DaskWorkers(client, None)


def _silence() -> None:
    """Dask logs that connections close; what matters reaches us as results."""
    for name in ("distributed", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
