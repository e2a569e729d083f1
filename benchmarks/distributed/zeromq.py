"""A bare loop over ZeroMQ: a ROUTER in the middle, DEALERs around it, over TCP."""

import importlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any

from typing_extensions import override

from benchmarks.distributed.children import ended
from benchmarks.distributed.hub import Hub, start_worker


class ZeroMqHub(Hub):
    """A ROUTER socket, which knows workers by their numbers.

    Args:
        router: the socket.
    """

    def __init__(self, router: Any) -> None:
        self._router = router

    @override
    def send(self, worker: int, message: bytes) -> None:
        self._router.send_multipart([b"%d" % worker, message])

    @override
    def receive(self, awaited: Collection[int]) -> tuple[int, bytes]:
        worker, message = self._router.recv_multipart()
        return int(worker), message


@contextmanager
def open_router(workers: int) -> Iterator[Hub]:
    """Start workers and wait until each has said that it is there."""
    zmq = importlib.import_module("zmq")
    with zmq.Context() as context, context.socket(zmq.ROUTER) as router:
        endpoint = f"tcp://127.0.0.1:{router.bind_to_random_port('tcp://127.0.0.1')}"
        processes = [start_worker(["zeromq", endpoint, number]) for number in range(workers)]
        with ended(processes):
            for _ in processes:
                router.recv_multipart()
            hub = ZeroMqHub(router)
            yield hub
            for number in range(workers):
                hub.send(number, b"")
