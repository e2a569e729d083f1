"""Workers of a campaign that are this very process."""

import contextlib
from collections.abc import Generator, Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

from orchestrator.campaign.work import Result, RunKey, Work, perform
from orchestrator.campaign.workers import Workers


class HereAndNow:
    """Performs runs in this process, one after the other."""

    def __init__(self) -> None:
        self.done: list[Work] = []

    def results(
        self, work: Iterable[tuple[RunKey, Work]]
    ) -> Generator[tuple[RunKey, Result], None, None]:
        for key, each in work:
            self.done.append(each)
            result = perform(each)
            yield key, result if result.error is None else perform(each)

    @contextlib.contextmanager
    def pool(self) -> Iterator[Workers]:
        yield self


def workers_here(count: int | None, scratch: Path) -> AbstractContextManager[Workers]:
    """Instead of `orchestrator.campaign.workers.local_workers`."""
    del count, scratch
    return HereAndNow().pool()
