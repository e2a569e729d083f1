"""A disk that is full, for which files of limited size stand; on Linux."""

import sys
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from typing_extensions import override

from orchestrator.campaign.work import Result, RunKey, Work
from tests.workers import HereAndNow

if sys.platform != "win32":
    import resource


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """No file can grow beyond `size` [byte], as on a disk that is full."""
    with files_as_before():
        limit(size)
        yield


@contextmanager
def files_as_before() -> Iterator[None]:
    """However they are limited here, they are not afterwards."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def limit(size: int) -> None:
    """From now on no file can grow beyond `size` [byte]."""
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, most))


class DiskFillsUp(HereAndNow):
    """Performs runs in this process, until there is no room for what one says, nor later.

    The test makes room again: `files_as_before`.

    Args:
        journal: a file that should grow then.
        after: how many runs are performed until then.
    """

    def __init__(self, journal: Path, after: int) -> None:
        super().__init__()
        self._journal = journal
        self._after = after

    @override
    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        for result in super().results(work):
            if len(self.done) == self._after:
                limit(self._journal.stat().st_size + 1)
            yield result
