"""Hosts for tests: scenarios, servers in this process, and a proxy that spoils connections."""

import asyncio
import random
import socket
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from adapters.keys.making import make_credentials
from orchestrator.hosts_file import read_hosts
from orchestrator.network import network
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.run import run_scenario
from orchestrator.run_outcome import RunOutcome
from orchestrator.scenario.build import load_scenario
from orchestrator.serving.server import Server
from orchestrator.serving.stand import Stand

PARTS = '''\
import json
import logging
import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector


class Follow(Component, PortableState):
    """y follows u, with noise of its own."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        rate: float = parameter(1.0, unit="1/s", doc="how fast")
        deed: str = parameter("", doc="what it does at 0.03 s")
        pause: float = parameter(0.0, unit="s", doc="of each step")
        mark: str = parameter("", doc="the path of what it leaves when it dies")
        data: Path = parameter(Path(), doc="a file")

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT),
        "pid": Connector(causality=Causality.OUTPUT, dtype=np.int64),
    }

    def __init__(self, parameters):
        self._p = parameters
        if parameters.deed == "dawdle":
            time.sleep(60)

    def setup(self, start, rng):
        self._rng, self._y = rng, 0.0

    def step(self, inputs, t, h):
        time.sleep(self._p.pause)
        if t == 30_000_000 and self._p.deed:
            getattr(self, self._p.deed)()
        u = float(np.asarray(inputs["u"]))
        self._y += 1e-9 * h * self._p.rate * (u - self._y) + self._rng.normal()

    def outputs(self):
        return {"y": np.array(self._y), "pid": np.array(os.getpid())}

    def dump(self):
        return json.dumps([self._rng.bit_generator.state, self._y]).encode()

    def load(self, content):
        self._rng.bit_generator.state, self._y = json.loads(content)

    def wait(self):
        while not Path(self._p.mark).exists():
            time.sleep(0.01)

    def die_once(self):
        if not Path(self._p.mark).exists():
            Path(self._p.mark).touch()
            self.die()

    def refuse(self):
        raise ValueError("the moon is too bright")

    def die(self):
        print("goodbye", flush=True)
        os.kill(os.getpid(), signal.SIGKILL)

    def speak(self):
        print("hello from the part", flush=True)
        logging.getLogger("parts").warning("fuel is low")
'''

SCENARIO = """\
schema: 1
title: A ring
time: {stop: 100 ms}
components:
  here: {type: "parts:Follow", step: 10 ms}
  near: {type: "parts:Follow", step: 10 ms, host: gpu}
  far: {type: "parts:Follow", step: 20 ms, host: partner, parameters: {rate: 2}}
  apart: {type: "parts:Follow", step: 10 ms, host: partner}
connections:
  - {from: here.y, to: near.u}
  - {from: near.y, to: far.u}
  - {from: far.y, to: apart.u}
  - {from: apart.y, to: here.u}
recording: {include: ["*.y"]}
"""


def free_port() -> int:
    """A port of the loopback interface that was free a moment ago.

    It is none of those that systems give to whoever asks for any, so that it is free until it is
    used: tests at the same time, and connections, take others.
    """
    chance = random.SystemRandom()
    while True:
        port = chance.randrange(20_000, 32_000)
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


def write_hosts(path: Path, ports: Mapping[str, int], *, by_tls: bool = False) -> Path:
    """A hosts file with hosts on the loopback interface; their credentials are made, too."""
    where = f"{'tls' if by_tls else 'tcp'}/127.0.0.1"
    lines = [f'  {name}: {{endpoint: "{where}:{port}"}}' for name, port in ports.items()]
    head = ["credentials: keys"] if by_tls else []
    path.write_text("\n".join([*head, "hosts:", *lines, ""]))
    if by_tls:
        make_credentials(read_hosts(path), datetime.now(tz=UTC), 1)
    return path


class Site:
    """A folder with a scenario, its code and a hosts file, as each party has one.

    Args:
        folder: is created.
        scenario: its text.
        ports: of the hosts.
    """

    def __init__(self, folder: Path, scenario: str, ports: Mapping[str, int]) -> None:
        folder.mkdir()
        self.folder = folder
        self.scenario = folder / "ring.yaml"
        self.scenario.write_text(scenario)
        self.code = folder / "parts.py"
        self.code.write_text(PARTS)
        self.hosts = write_hosts(folder / "hosts.yaml", ports)

    def run(self, out: str, *overrides: str, away: bool = True, **options: object) -> RunOutcome:
        """A run, by way of the hosts unless `away` is false."""
        return run_scenario(
            load_scenario(self.scenario, overrides),
            self.folder / out,
            hosts=read_hosts(self.hosts) if away else None,
            figure=False,
            **options,  # type: ignore[arg-type]
        )

    @contextmanager
    def serving(
        self, host: str, *names: str, overrides: Sequence[str] = (), processes: bool = False
    ) -> Iterator[list[str]]:
        """Components served in this process; yields the lines that are said."""
        said: list[str] = []
        with LocalTransport(shares=False) if processes else LoopbackTransport() as transport:
            stands = [
                Stand(name, lambda: load_scenario(self.scenario, overrides), transport)
                for name in names
            ]
            for stand in stands:
                stand.prepare()
            server = Server(stands, said.append)
            with network().lobby(read_hosts(self.hosts), host, server), server:
                yield said


class Proxy:
    """Hands on connections to a port, late and irregularly, and cuts them now and then.

    Args:
        target: the port, on the loopback interface.
        delay: of every piece, in each direction [s].
        jitter: up to which it is delayed more [s].
        cut: how likely a piece is the last one of its connection.
        seed: of all that is random.

    Attributes:
        is_shut: whether new connections end at once.
    """

    def __init__(
        self,
        target: int,
        *,
        delay: float = 0.0,
        jitter: float = 0.0,
        cut: float = 0.0,
        seed: int = 1,
    ) -> None:
        self._target = target
        self._delay, self._jitter, self.cut = delay, jitter, cut
        self._random = random.Random(seed)  # noqa: S311 - nothing is secret here
        self._writers: set[asyncio.StreamWriter] = set()
        self._made: list[asyncio.StreamWriter] = []
        self.connections = self.cuts = 0
        self.is_shut = False
        self.port = 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def __enter__(self) -> "Proxy":
        self._thread.start()
        self._server = asyncio.run_coroutine_threadsafe(
            asyncio.start_server(self._accept, "127.0.0.1", 0), self._loop
        ).result(10)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    def __exit__(self, *_: object) -> None:
        async def close() -> None:
            self._server.close()
            tasks = [t for t in asyncio.all_tasks() if t is not asyncio.current_task()]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for writer in self._made:
                writer.transport.abort()
            await asyncio.sleep(0.01)  # what is aborted is closed a moment later
            self._made.clear()
            self._writers.clear()

        asyncio.run_coroutine_threadsafe(close(), self._loop).result(10)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def cut_all(self) -> None:
        """Cut all connections now."""
        self._loop.call_soon_threadsafe(self._cut)

    def _cut(self) -> None:
        self.cuts += 1
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self._made.append(writer)
        if self.is_shut:
            writer.transport.abort()
            return
        try:
            far, there = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            writer.transport.abort()
            return
        self._made.append(there)
        self._writers |= {writer, there}
        await asyncio.gather(self._hand_on(reader, there), self._hand_on(far, writer))

    async def _hand_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Each piece in its order, some time after it came."""
        pieces: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def deliver() -> None:
            while True:
                at, piece = await pieces.get()
                await asyncio.sleep(max(0.0, at - self._loop.time()))
                if self._random.random() < self.cut:
                    self._cut()
                if not piece:
                    writer.close()
                    return
                writer.write(piece)

        delivery = asyncio.ensure_future(deliver())
        with suppress(ConnectionError, OSError):
            while piece := await reader.read(1 << 16):
                late = self._delay + self._random.random() * self._jitter
                pieces.put_nowait((self._loop.time() + late, piece))
        pieces.put_nowait((self._loop.time(), b""))
        with suppress(ConnectionError, OSError):
            await delivery


def until(condition: Callable[[], bool], within: float = 30.0) -> bool:
    """Whether the condition comes true within so many seconds."""
    event = threading.Event()
    waited = 0.0
    while waited < within:
        if condition():
            return True
        event.wait(0.01)
        waited += 0.01
    return condition()
