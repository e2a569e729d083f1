"""Loops without a framework: a process in the middle, and workers around it."""

import abc
import subprocess
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager
from time import perf_counter_ns

import numpy as np
from typing_extensions import override

from benchmarks.distributed.children import spawn
from benchmarks.distributed.participant import Participant
from benchmarks.distributed.ring import PARALLEL, DifferentValuesError, Ring
from benchmarks.distributed.worker import HEAD
from orchestrator.signal import Array


class Hub(abc.ABC):
    """The way to the workers, by their numbers."""

    @abc.abstractmethod
    def send(self, worker: int, message: bytes) -> None:
        """Send a message; do not wait for the answer."""

    @abc.abstractmethod
    def receive(self, awaited: Collection[int]) -> tuple[int, bytes]:
        """The next answer of one of these workers, and whose it is."""


class HubParticipant(Participant):
    """A bare loop over some transport.

    Args:
        label: what it is called.
        open_hub: starts so many workers; their end is that of the context.
        why_not: why it cannot be measured here; empty if it can.
        most: members that it is asked for at most.
    """

    def __init__(
        self,
        label: str,
        open_hub: Callable[[int], AbstractContextManager[Hub]],
        *,
        why_not: str = "",
        most: int = 50,
    ) -> None:
        self.most = most
        self.label = label
        self._open_hub = open_hub
        self._why_not = why_not

    @property
    @override
    def why_not(self) -> str:
        return self._why_not

    @override
    def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
        found = []
        values = [ring.start(member) for member in range(ring.members)]
        with self._open_hub(ring.members) as hub:
            for step in range(steps):
                found.append(perf_counter_ns())
                if ring.algorithm == PARALLEL:
                    values = _at_once(hub, step, values)
                else:
                    _in_turns(hub, step, values)
            found.append(perf_counter_ns())
        right = [ring.is_last(member, value, steps) for member, value in enumerate(values)]
        ring.check(self.label, right, steps)
        return found


def _at_once(hub: Hub, step: int, values: list[Array]) -> list[Array]:
    for worker in range(len(values)):
        hub.send(worker, _message(step, values[worker - 1]))
    awaited = set(range(len(values)))
    made = list(values)
    while awaited:
        worker, answer = hub.receive(awaited)
        awaited.remove(worker)
        made[worker] = _value(step, answer)
    return made


def _in_turns(hub: Hub, step: int, values: list[Array]) -> None:
    for worker in range(len(values)):
        hub.send(worker, _message(step, values[worker - 1]))
        values[worker] = _value(step, hub.receive({worker})[1])


def _message(step: int, value: Array) -> bytes:
    return b"".join((HEAD.pack(step), value.data))


def _value(step: int, message: bytes) -> Array:
    if HEAD.unpack_from(message) != (step,):
        raise DifferentValuesError(f"an answer to another step than {step}")
    return np.frombuffer(message, np.float64, offset=HEAD.size)


def start_worker(
    arguments: Sequence[object], descriptors: Sequence[int] = ()
) -> "subprocess.Popen[bytes]":
    """Start a worker, which inherits these descriptors."""
    return spawn("benchmarks.distributed.worker", arguments, descriptors)
