"""A bare loop over Zenoh: publications, a key for each worker and direction, over TCP."""

import json
import socket
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from time import sleep
from typing import Final

import zenoh
from typing_extensions import override
from zenoh.handlers import Callback

from adapters.zenoh.session import COMMON, close_session, is_matched, open_session
from benchmarks.distributed.children import ended
from benchmarks.distributed.hub import Hub, start_worker

_BLOCK: Final = zenoh.CongestionControl.BLOCK


class ZenohHub(Hub):
    """One publisher for each worker, one subscriber for all.

    Args:
        session: a peer that listens.
        workers: how many.
    """

    def __init__(self, session: zenoh.Session, workers: int) -> None:
        self._answers: SimpleQueue[tuple[int, bytes]] = SimpleQueue()
        self._subscriber = session.declare_subscriber(
            "ring/*/out", Callback(self._on_answer, indirect=False)
        )
        self._publishers = [
            session.declare_publisher(f"ring/{n}/cmd", congestion_control=_BLOCK, express=True)
            for n in range(workers)
        ]

    def await_workers(self) -> None:
        """Wait until all are there, and each knows that we listen."""
        for publisher in self._publishers:
            while not is_matched(publisher):
                sleep(0.001)
        for _ in self._publishers:
            self._answers.get()

    @override
    def send(self, worker: int, message: bytes) -> None:
        self._publishers[worker].put(message)

    @override
    def receive(self, awaited: Collection[int]) -> tuple[int, bytes]:
        return self._answers.get()

    def _on_answer(self, sample: zenoh.Sample) -> None:
        number = int(str(sample.key_expr).split("/")[1])
        self._answers.put((number, sample.payload.to_bytes()))


@contextmanager
def open_session_hub(workers: int) -> Iterator[Hub]:
    """Start workers and wait until they and we listen to each other."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    session = open_session({"mode": "peer", "listen/endpoints": [endpoint]})
    try:
        hub = ZenohHub(session, workers)
        theirs = json.dumps({**COMMON, "mode": "client", "connect/endpoints": [endpoint]})
        with ended([start_worker(["zenoh", theirs, number]) for number in range(workers)]):
            hub.await_workers()
            yield hub
            for number in range(workers):
                hub.send(number, b"")
    finally:
        close_session(session)
