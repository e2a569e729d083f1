"""A bare loop over pipes of `multiprocessing`, which on POSIX are socket pairs."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any

from typing_extensions import override

from benchmarks.distributed.children import ended
from benchmarks.distributed.hub import Hub, start_worker


class PipeHub(Hub):
    """One connection for each worker.

    Args:
        connections: our ends.
    """

    def __init__(self, connections: "list[Connection[Any, Any]]") -> None:
        self._connections = connections
        self._numbers = {id(each): number for number, each in enumerate(connections)}
        self._ready: list[Any] = []

    @override
    def send(self, worker: int, message: bytes) -> None:
        self._connections[worker].send_bytes(message)

    @override
    def receive(self, awaited: Collection[int]) -> tuple[int, bytes]:
        if len(awaited) == 1 and not self._ready:
            (only,) = awaited
            return only, self._connections[only].recv_bytes()
        if not self._ready:
            self._ready = list(wait([self._connections[worker] for worker in awaited]))
        found = self._ready.pop()
        return self._numbers[id(found)], found.recv_bytes()


@contextmanager
def open_pipes(workers: int) -> Iterator[Hub]:
    """Start workers, each at the other end of a pipe."""
    pairs = [Pipe() for _ in range(workers)]
    processes = []
    for _, theirs in pairs:
        processes.append(start_worker(["pipe", theirs.fileno()], [theirs.fileno()]))
        theirs.close()
    with ended(processes):
        yield PipeHub([ours for ours, _ in pairs])
        for ours, _ in pairs:
            ours.send_bytes(b"")
    for ours, _ in pairs:
        ours.close()
