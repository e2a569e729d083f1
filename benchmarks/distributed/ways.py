"""`python -m benchmarks.distributed.ways`: the ways that values may take between two hosts.

A model, without components, of a ring on three machines: the run with member 0, and two hosts
with the others. Every line is a TCP connection that delivers what it is given a fixed time later.
Values go `run`: through the run, as ours do; or `direct`: from host to host. The run orders a step
`in-turn`: when all that it reads is known, as ours does; `ahead`: all steps of a macro step at its
start; or `far-ahead`: several macro steps. A host that has the order of a step makes it when the
value is there. Every output goes to the run, which records it.
"""

import argparse
import itertools
import pickle
import socket
import struct
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from queue import SimpleQueue
from time import monotonic, perf_counter, sleep
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from benchmarks.distributed.ring import PARALLEL, SEQUENTIAL, Ring
from orchestrator.signal import Array

FAR: Final = 8
"""Macro steps that are ordered at once, far ahead."""

_LENGTH: Final = struct.Struct("<Q")
_RUN: Final = "run"


class Item(NamedTuple):
    """What travels: an order, or a value.

    Attributes:
        member: whose step is ordered, or whose output it is.
        step: which one, from 1 on.
        is_order: whether the step is ordered.
        value: the output, if it is one.
    """

    member: int
    step: int
    is_order: bool = False
    value: Array | None = None


Send: TypeAlias = Callable[[Item], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """How a ring on hosts works.

    Attributes:
        is_direct: whether hosts send each other values.
        ahead: macro steps whose orders are given at once; 0: each in its turn.
    """

    is_direct: bool
    ahead: int

    @property
    def name(self) -> str:
        """What it is called."""
        orders = {0: "in-turn", 1: "ahead"}.get(self.ahead, "far-ahead")
        return f"{'direct' if self.is_direct else 'run'}, {orders}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A ring, who has which member, and how it works.

    Attributes:
        ring: what is computed.
        place: where each member is, by number: `run` or a host.
        way: how it works.
    """

    ring: Ring
    place: tuple[str, ...]
    way: Way

    def source(self, member: int, step: int) -> tuple[int, int]:
        """Whose output a step reads, and of which step; 0 is the start."""
        is_newest = self.ring.algorithm == SEQUENTIAL and member > 0
        return (member - 1) % self.ring.members, step if is_newest else step - 1

    def reader(self, member: int) -> str:
        """Where the output of a member is read."""
        return self.place[(member + 1) % self.ring.members]


@dataclass(slots=True)
class Machine:
    """The members at one place, and what is known there.

    Attributes:
        plan: of all.
        name: of the place.
        known: outputs by member and step.
        orders: steps that were ordered and not made, by member.
        made: called with each output that is made here.
        recorded: outputs that the run has.
    """

    plan: Plan
    name: str
    made: Send
    known: dict[tuple[int, int], Array] = field(default_factory=dict)
    recorded: set[tuple[int, int]] = field(default_factory=set)
    orders: dict[int, list[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        ring = self.plan.ring
        self.known.update(((member, 0), ring.start(member)) for member in range(ring.members))

    def take(self, item: Item) -> None:
        """Note what came, and make all steps that can be made now."""
        if item.is_order:
            self.orders.setdefault(item.member, []).append(item.step)
        elif item.value is not None:
            self.known[item.member, item.step] = item.value
        while (ready := self._ready()) is not None:
            member, step = ready
            self.orders[member].remove(step)
            output = self.known[self.plan.source(member, step)] + 1.0
            self.known[member, step] = output
            self.known.pop((member, step - FAR - 2), None)
            self.made(Item(member, step, value=output))

    def _ready(self) -> tuple[int, int] | None:
        for member, steps in self.orders.items():
            if steps and self.plan.source(member, min(steps)) in self.known:
                return member, min(steps)
        return None


class Line:
    """One end of a connection whose messages arrive `delay` [s] after they were sent.

    Args:
        connection: to the other end.
        delay: of what is sent here [s].
        arrived: called, in another thread, with what comes.

    Attributes:
        sent, received: so far [byte].
    """

    def __init__(self, connection: socket.socket, delay: float, arrived: Send) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection
        self._delay = delay
        self._waiting: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
        self.sent = self.received = 0
        works = (self._deliver, lambda: self._listen(arrived))
        self._threads = [threading.Thread(target=work, daemon=True) for work in works]
        for thread in self._threads:
            thread.start()

    def send(self, item: Item) -> None:
        """Have it arrive after the delay."""
        raw = pickle.dumps(tuple(item), protocol=5)
        self.sent += len(raw)
        self._waiting.put((monotonic() + self._delay, _LENGTH.pack(len(raw)) + raw))

    def close(self) -> None:
        """End both directions, behind what is on its way."""
        self._waiting.put((0.0, b""))
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join()

    def _deliver(self) -> None:
        with suppress(OSError):  # the other end is ended by force
            while (item := self._waiting.get())[1]:
                sleep(max(0.0, item[0] - monotonic()))
                self._connection.sendall(item[1])

    def _listen(self, arrived: Send) -> None:
        with suppress(OSError), self._connection.makefile("rb") as reader:
            while head := reader.read(_LENGTH.size):
                raw = reader.read(*_LENGTH.unpack(head))
                self.received += len(raw)
                arrived(Item(*pickle.loads(raw)))  # noqa: S301 - from a process of ours


def _host(name: str, plan: Plan, delay: float, ends: Mapping[str, socket.socket]) -> None:
    """A host with connections to other places, which works until its process is ended."""
    came: SimpleQueue[Item] = SimpleQueue()
    lines = {place: Line(end, delay, came.put) for place, end in ends.items()}

    def made(item: Item) -> None:
        reader = plan.reader(item.member)
        if plan.way.is_direct and reader not in (name, _RUN):
            lines[reader].send(item)
        lines[_RUN].send(item)

    machine = Machine(plan, name, made)
    while True:
        machine.take(came.get())


class Run:
    """The run: gives orders, hands on values, and records all of them.

    Args:
        plan: of all.
        delay: of each line [s].
        ends: of the connections to the hosts.
    """

    def __init__(self, plan: Plan, delay: float, ends: Mapping[str, socket.socket]) -> None:
        self._plan = plan
        self._came: SimpleQueue[Item] = SimpleQueue()
        self._lines = {host: Line(end, delay, self._came.put) for host, end in ends.items()}
        self._machine = Machine(plan, _RUN, self._came.put)
        self._ordered = 0

    @property
    def traffic(self) -> int:
        """What was sent and received over its lines [byte]."""
        return sum(line.sent + line.received for line in self._lines.values())

    def step(self, step: int, steps: int) -> None:
        """Make a macro step of so many."""
        members = range(self._plan.ring.members)
        ahead = self._plan.way.ahead
        turns = self._plan.ring.algorithm == SEQUENTIAL and not ahead
        while self._ordered < min(step + max(ahead, 1) - 1, steps):
            self._ordered += 1
            for member in members:
                self._order(member, self._ordered)
                if turns:
                    self._await([(member, self._ordered)])
        self._await([(member, step) for member in members])

    def close(self) -> None:
        """Hear nothing any more."""
        for line in self._lines.values():
            line.close()

    def values(self, step: int) -> Mapping[int, Array]:
        """The outputs of a step, by member, of any shape each."""
        return {m: self._machine.known[m, step] for m in range(self._plan.ring.members)}

    def _order(self, member: int, step: int) -> None:
        order = Item(member, step, is_order=True)
        place = self._plan.place[member]
        if place == _RUN:
            self._machine.take(order)
        else:
            self._lines[place].send(order)

    def _await(self, outputs: list[tuple[int, int]]) -> None:
        while not all(each in self._machine.recorded for each in outputs):
            item = self._came.get()
            self._machine.recorded.add((item.member, item.step))
            self._machine.take(item)
            source, reader = self._plan.place[item.member], self._plan.reader(item.member)
            goes_direct = self._plan.way.is_direct and source != _RUN
            if reader not in (_RUN, source) and not goes_direct:
                self._lines[reader].send(item)


def measure(plan: Plan, delay: float, steps: int) -> tuple[list[float], int]:
    """Make a ring go round over lines with a delay [s].

    Returns:
        The wall time of each macro step but the first, in which hosts start [s], and the traffic
        of the run's lines in all [byte].

    Raises:
        DifferentValuesError: the last values are wrong.
    """
    hosts = sorted(set(plan.place) - {_RUN})
    ends: dict[str, dict[str, socket.socket]] = {place: {} for place in (_RUN, *hosts)}
    for one, other in itertools.combinations((_RUN, *hosts), 2):
        ends[one][other], ends[other][one] = _connection()
    fork = get_context("fork")  # sockets are inherited, and no thread of this runs yet
    processes = [
        fork.Process(target=_host, args=(host, plan, delay, ends[host]), daemon=True)
        for host in hosts
    ]
    with ExitStack() as stack:
        for end in (end for found in ends.values() for end in found.values()):
            stack.callback(end.close)
        for process in processes:
            process.start()
            stack.callback(process.join)
            stack.callback(process.kill)
        run = Run(plan, delay, ends[_RUN])
        stack.callback(run.close)
        times = []
        for step in range(1, steps + 1):
            before = perf_counter()
            run.step(step, steps)
            times.append(perf_counter() - before)
        found = run.values(steps)
        right = [plan.ring.is_last(member, value, steps) for member, value in found.items()]
        plan.ring.check(plan.way.name, right, steps)
        return times[1:], run.traffic


def _connection() -> tuple[socket.socket, socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        one = socket.create_connection(server.getsockname())
        return one, server.accept()[0]


WAYS: Final = tuple(Way(is_direct=d, ahead=a) for a in (0, 1, FAR) for d in (False, True))
PLACES: Final = {3: (_RUN, "a", "b"), 5: (_RUN, "a", "a", "b", "b")}


def main() -> None:
    """Measure all ways in turn, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--delay", type=float, default=20.0, help="of each line [ms]")
    parser.add_argument("--steps", type=int, default=30, help="macro steps")
    parser.add_argument("--size", type=int, default=12800, help="of an array [byte]")
    chosen = parser.parse_args()
    for members, algorithm in itertools.product(PLACES, (PARALLEL, SEQUENTIAL)):
        for way in WAYS:
            ring = Ring(chosen.size, algorithm, members)
            plan = Plan(ring=ring, place=PLACES[members], way=way)
            times, traffic = measure(plan, chosen.delay / 1e3, chosen.steps)
            row = (
                f"{ring.name} {chosen.delay:g} ms {way.name}: "
                f"mean {1e3 * np.mean(times):.1f}, median {1e3 * np.median(times):.1f} ms, "
                f"{traffic / chosen.steps / 1e3:.1f} kB of the run"
            )
            print(row, flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
