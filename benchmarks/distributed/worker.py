"""`python -m benchmarks.distributed.worker WAY ARGUMENT...`: a worker of a bare loop.

It adds 1 to every element of what it gets and sends that back. A message is the number of the
step, u64 little-endian, 8 bytes of zero, and the array; an empty one is the end.
`benchmarks.distributed.hub` has the other side.
"""

import importlib
import json
import struct
import sys
from collections.abc import Callable, Mapping
from time import sleep
from typing import Any, Final

import numpy as np

HEAD: Final = struct.Struct("<Q8x")


def answer(message: bytes) -> bytes:
    """What a worker sends back."""
    value = np.frombuffer(message, np.float64, offset=HEAD.size) + 1.0
    return b"".join((message[: HEAD.size], value.data))


def work(receive: Callable[[], bytes], send: Callable[[bytes], object]) -> None:
    """Answer messages until an empty one comes."""
    while message := receive():
        send(answer(message))


def pipe(descriptor: str) -> None:
    """A connection of `multiprocessing`."""
    found = importlib.import_module("multiprocessing.connection").Connection(int(descriptor))
    work(found.recv_bytes, found.send_bytes)


def zeromq(endpoint: str, number: str) -> None:
    """A DEALER, which a ROUTER knows by its number."""
    zmq = importlib.import_module("zmq")
    with zmq.Context() as context, context.socket(zmq.DEALER) as dealer:
        dealer.setsockopt(zmq.IDENTITY, number.encode())
        dealer.connect(endpoint)
        dealer.send(b"ready")
        work(dealer.recv, dealer.send)


def zenoh(settings: str, number: str) -> None:
    """A client with a key for each direction."""
    found: Any = importlib.import_module("zenoh")
    config = found.Config()
    for key, value in json.loads(settings).items():
        config.insert_json5(key, json.dumps(value))
    with found.open(config) as session:
        output = session.declare_publisher(
            f"ring/{number}/out", congestion_control=found.CongestionControl.BLOCK, express=True
        )
        commands = session.declare_subscriber(f"ring/{number}/cmd", found.handlers.FifoChannel(8))
        while not output.matching_status.matching:
            sleep(0.001)
        output.put(b"ready")

        def receive() -> bytes:
            found: bytes = commands.recv().payload.to_bytes()
            return found

        work(receive, output.put)


_WAYS: Final[Mapping[str, Callable[..., None]]] = {"pipe": pipe, "zeromq": zeromq, "zenoh": zenoh}

if __name__ == "__main__":
    _WAYS[sys.argv[1]](*sys.argv[2:])
