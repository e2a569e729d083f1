"""Requests that come while workers start are heard, once these have."""

import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

import pytest

from orchestrator.campaign.deferral import deferred
from orchestrator.campaign.workers import local_workers
from orchestrator.errors import CosimError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="it has no such signals")


@pytest.fixture
def heard() -> Iterator[list[int]]:
    """What a handler of SIGTERM heard, which raises `KeyboardInterrupt`."""
    found: list[int] = []

    def handler(number: int, frame: FrameType | None) -> None:
        del frame
        found.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, handler)
    yield found
    signal.signal(signal.SIGTERM, before)


def test_a_request_is_heard_once_at_the_end(heard: list[int]) -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), deferred():  # noqa: PT012 - that is the law
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        done.append(len(heard))
    assert (done, heard) == ([0], [signal.SIGTERM])
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)


def test_a_request_is_heard_also_after_an_error(heard: list[int]) -> None:
    with pytest.raises(KeyboardInterrupt) as caught, deferred():  # noqa: PT012
        signal.raise_signal(signal.SIGTERM)
        raise RuntimeError("failed to start")
    assert str(caught.value.__context__) == "failed to start"
    assert heard == [signal.SIGTERM]


def test_without_a_request_nothing_happens(heard: list[int]) -> None:
    with deferred():
        pass
    with pytest.raises(RuntimeError, match="own"), deferred():
        raise RuntimeError("own")
    assert heard == []


def test_other_threads_and_what_is_not_handled_are_not_concerned() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with deferred():
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        found: list[object] = []

        def elsewhere() -> None:
            with deferred():
                found.append(signal.getsignal(signal.SIGINT))

        thread = threading.Thread(target=elsewhere)
        thread.start()
        thread.join()
        assert found == [signal.getsignal(signal.SIGINT)]
    finally:
        signal.signal(signal.SIGHUP, before)


def test_workers_that_do_not_start_are_no_bug(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Few descriptors are enough: Dask waits for half a minute, and gives up."""
    distributed = pytest.importorskip("distributed", reason="the extra `experiment` is missing")

    def fails(**_: object) -> None:
        raise RuntimeError("Cluster failed to start: Timed out")

    monkeypatch.setattr(distributed, "LocalCluster", fails)
    told = "the worker processes cannot be started: Cluster failed to start: Timed out"
    with pytest.raises(CosimError, match=told), local_workers(1, tmp_path):
        pass
