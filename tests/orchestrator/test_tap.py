"""A tap shows a run and never holds it up, whoever reads and however slowly."""

import json
import logging
import os
import socket
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.stretch import Samples, Stretch
from orchestrator.system import System
from orchestrator.tap.client import TapClient
from orchestrator.tap.place import FILE, NoTapError, Place
from orchestrator.tap.server import LARGEST, Tap
from orchestrator.tap.stream import PUBLICATIONS, PUBLISHED, Kind, Message, Reader
from orchestrator.tap.watcher import Watcher
from orchestrator.tap.websocket import CLOSE, Frames, accepted, framed
from orchestrator.timebase import Duration, Time

MS = 1_000_000
OUTPUT = Causality.OUTPUT


class Counter(Component):
    """Counts its steps; one output is as large as it is told to make it."""

    def __init__(self, size: int = 1) -> None:
        self._size = size
        self._count = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "count": Connector(causality=OUTPUT, dtype=np.int64),
            "many": Connector(causality=OUTPUT, shape=("n",)),
            "raw": Connector(causality=OUTPUT, dtype=None, mime_type="text/plain"),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._count = 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._count += 1

    @override
    def outputs(self) -> Signals:
        return {
            "count": np.array(self._count),
            "many": np.full(self._size, float(self._count)),
            "raw": str(self._count).encode(),
        }


class Meanwhile(Observer):
    """Calls something at each communication point."""

    def __init__(self, what: Callable[[Time], None]) -> None:
        self._what = what

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self._what(t)

    @override
    def end(self, result: SimulationResult) -> None:
        pass


class Clock:
    """Wall time that passes as it is told to."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def run(tap: Tap, meanwhile: Callable[[Time], None] = lambda t: None, *, steps: int = 50,
        size: int = 1) -> SimulationResult:  # fmt: skip
    """A run of two counters: `fast` each 10 ms, `slow` each 20 ms."""
    counters = {"fast": Counter(size), "slow": Counter()}
    system = System(counters, {"fast": 10 * MS, "slow": 20 * MS}, [])
    observers = [Meanwhile(meanwhile), tap]
    return simulate(system, Jacobi(), start=0, stop=steps * 10 * MS, seed=1, observers=observers)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def tap(clock: Clock, tmp_path: Path) -> Iterator[Tap]:
    """A tap that listens, and whose clock stands still but for what a test does."""
    with Tap(clock=clock) as made:
        made.listen(tmp_path)
        yield made


OPENED: list[socket.socket] = []


@pytest.fixture(autouse=True)
def _closing() -> Iterator[None]:
    """Closes the connections that a test has made."""
    yield
    while OPENED:
        OPENED.pop().close()


def connected(folder: Path) -> socket.socket:
    """A connection to a tap; closed after the test."""
    OPENED.append(socket.create_connection(("127.0.0.1", Place.read(folder).port), 5))
    return OPENED[-1]


def asking(folder: Path, *keys: str, rate: float = 50.0, token: str | None = None) -> socket.socket:
    """A connection that has asked for messages, and has not looked for an answer."""
    place = Place.read(folder)
    found = connected(folder)
    query = "&".join([f"token={place.token if token is None else token}", f"rate={rate:g}",
                      *(f"key={key}" for key in keys)])  # fmt: skip
    found.sendall(
        f"GET /tap?{query} HTTP/1.1\r\nUpgrade: websocket\r\nSec-WebSocket-Key: a\r\n\r\n".encode()
    )
    return found


def said(connection: socket.socket) -> list[Message]:
    """All messages that come until the end."""
    received = bytearray()
    connection.settimeout(5)
    while piece := connection.recv(1 << 20):
        received += piece
    head, _, rest = received.partition(b"\r\n\r\n")
    assert b" 101 " in head, head
    reader, frames = Reader(), Frames()
    found = [reader.decode(raw) for raw in frames.feed(bytes(rest))]
    assert frames.is_closed
    return found


def test_a_reader_sees_the_values_of_each_point_until_the_end(
    tap: Tap, clock: Clock, tmp_path: Path
) -> None:
    """With 20 ms of wall time from point to point it sees each of them."""
    connection = asking(tmp_path)

    def pass_time(t: Time) -> None:
        clock.now += 0.021

    run(tap, pass_time)
    first, *values, end = said(connection)
    assert first.kind is Kind.SCHEMA
    assert first.document is not None
    assert (first.document["start"], first.document["stop"]) == (0, 500 * MS)
    assert first.document["components"] == ["fast", "slow"]
    assert end.document == {"status": "done", "error": None, "ended_early": None}
    assert end.t == 500 * MS
    assert [each.t for each in values] == [*range(0, 501 * MS, 10 * MS), 500 * MS]
    for number, each in enumerate(values[:-1]):
        assert each.values is not None
        assert each.points == number + 1
        assert each.left_out == 0
        assert int(np.asarray(each.values["fast.count"])) == number
        assert each.values["slow.raw"] == str(number // 2).encode()
        assert np.asarray(each.values[PUBLISHED]).tolist() == [
            each.t,
            each.t // (20 * MS) * 20 * MS,
        ]
        assert np.asarray(each.values[PUBLICATIONS]).tolist() == [number + 1, number // 2 + 1]


def test_a_reader_is_sent_no_more_than_it_wants(tap: Tap, clock: Clock, tmp_path: Path) -> None:
    """Of a run that takes 10 s, five per second are 50; and each pattern adds signals."""
    connection = asking(tmp_path, "fast.c*", "slow.raw", rate=5)

    def pass_time(t: Time) -> None:
        clock.now += 0.01

    run(tap, pass_time, steps=1000)
    first, *values, _ = said(connection)
    assert first.document is not None
    names = [each["name"] for each in first.document["signals"]]
    assert names == [PUBLISHED, PUBLICATIONS, "fast.count", "slow.raw"]
    assert len(values) == pytest.approx(51, abs=2)
    assert {frozenset(each.values or ()) for each in values} == {frozenset(names)}


def test_large_values_are_for_those_who_name_them(tap: Tap, clock: Clock, tmp_path: Path) -> None:
    """More than 64 KB are 8193 numbers."""
    everything, named = asking(tmp_path), asking(tmp_path, "*.many")
    run(tap, steps=6, size=LARGEST // 8 + 1)
    _, *values, _ = said(everything)
    assert all("fast.many" not in (each.values or ()) for each in values)
    assert all("slow.many" in (each.values or ()) for each in values)
    _, *values, _ = said(named)
    assert all(np.size((each.values or {})["fast.many"]) == 8193 for each in values)


@pytest.mark.parametrize("cost", [0.001, 0.1])
def test_a_tap_takes_one_per_cent_of_the_time(
    tmp_path: Path, clock: Clock, cost: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long a message takes: after each there is a pause of a hundred times as long."""
    spent = 0.0
    send = Watcher.send

    def costly(watcher: Watcher, message: Message) -> None:
        nonlocal spent
        clock.now += cost
        spent += cost
        send(watcher, message)

    def pass_time(t: Time) -> None:
        clock.now += 0.01

    monkeypatch.setattr(Watcher, "send", costly)
    with Tap(clock=clock) as tap:
        tap.listen(tmp_path)
        connection = asking(tmp_path)
        began = clock.now
        run(tap, pass_time, steps=10_000)
    connection.close()
    taken = (spent - 2 * cost) / (clock.now - began)  # but for the end
    assert taken <= 0.01 * 1.2
    assert taken >= 0.008  # and it takes what it may


def test_a_reader_that_does_not_read_holds_nobody_up(
    tap: Tap, clock: Clock, tmp_path: Path
) -> None:
    """The system takes a few of 400 messages of 200 kB; the rest is left out and counted."""
    stuck, other = asking(tmp_path, "fast.many"), asking(tmp_path, "fast.count")
    stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
    longest = 0.0
    last = time.perf_counter()

    def pass_time(t: Time) -> None:
        nonlocal longest, last
        clock.now += 0.021
        now = time.perf_counter()
        longest, last = max(longest, now - last), now

    run(tap, pass_time, steps=400, size=25_000)
    assert longest < 1.0
    assert len([each for each in said(other) if each.kind is Kind.VALUES]) == 402
    stuck.settimeout(5)
    received = 0
    while piece := stuck.recv(1 << 20):
        received += len(piece)
    assert 200_000 <= received < 100 * 200_000


def test_points_that_compiled_code_worked_through_count_too(
    tap: Tap, clock: Clock, tmp_path: Path
) -> None:
    """Three points of `fast` and none of `slow`; a reader sees the last."""
    connection = asking(tmp_path, "fast.count")

    def stretch(t: Time) -> None:
        clock.now += 0.021
        if t == 40 * MS:
            times = np.array([50 * MS, 60 * MS, 70 * MS])
            last = {"fast": {"count": np.array(7)}, "slow": {}}
            samples = {"fast": Samples(times, {}), "slow": Samples(np.empty(0, np.int64), {})}
            tap.observe_stretch(Stretch(70 * MS, 3, samples, last))
            clock.now += 0.021

    run(tap, stretch, steps=4)
    values = [each for each in said(connection) if each.kind is Kind.VALUES]
    (worked,) = (each for each in values if each.t == 70 * MS)
    assert worked.values is not None
    assert int(np.asarray(worked.values["fast.count"])) == 7
    assert np.asarray(worked.values[PUBLISHED]).tolist() == [70 * MS, 20 * MS]
    assert np.asarray(worked.values[PUBLICATIONS]).tolist() == [4 + 3, 2]
    assert worked.points == 4 + 3


@pytest.mark.parametrize("length", [0, 125, 126, 127, 65535, 65536])
def test_frames_are_whole_however_they_arrive(length: int) -> None:
    """Bit for bit, also where their head is cut in two."""
    first, second = os.urandom(length), b"end"
    content = framed(first) + framed(second)
    for cut in (1, 2, 3, 4, 9, 10, 11, len(content) - 1):
        frames = Frames()
        found = [*frames.feed(content[:cut]), *frames.feed(content[cut:])]
        assert found == [first, second]
        assert not frames.is_closed
    frames = Frames()
    begin = [each for byte in content[:20] for each in frames.feed(bytes([byte]))]
    assert [*begin, *frames.feed(content[20:] + CLOSE + framed(first))] == [first, second]
    assert frames.is_closed


def test_the_key_of_a_request_is_answered_as_the_standard_says() -> None:
    """The example of RFC 6455, section 1.3."""
    assert accepted("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="


def test_who_reads_on_is_told_what_was_left_out(tap: Tap, clock: Clock, tmp_path: Path) -> None:
    """All points are shown or counted as left out, also with a pause in between."""
    found: list[Message] = []
    slow = asking(tmp_path, "fast.many", "fast.count")
    begin = threading.Event()

    def read() -> None:
        begin.wait(20)
        found.extend(said(slow))

    reading = threading.Thread(target=read)
    reading.start()

    def pass_time(t: Time) -> None:
        clock.now += 0.021
        if t == 2000 * MS:
            begin.set()
        if t >= 2000 * MS:
            time.sleep(0.002)

    run(tap, pass_time, steps=400, size=20_000)
    reading.join()
    values = [each for each in found if each.kind is Kind.VALUES]
    lost = [each.left_out for each in values]
    assert sum(lost) > 10
    assert len(values[:-1]) + sum(lost) == 401
    assert all(int(np.asarray((v.values or {})["fast.count"])) * 10 * MS == v.t for v in values)


def answer(folder: Path, request: bytes, tap: Tap) -> bytes:
    """How a request is answered while a run goes on."""
    connection = connected(folder)
    connection.sendall(request)
    run(tap, steps=4)
    connection.settimeout(5)
    received = b""
    try:
        while piece := connection.recv(4096):
            received += piece
    except ConnectionResetError:
        pass
    return received


UPGRADE = b"HTTP/1.1\r\nUpgrade: websocket\r\nSec-WebSocket-Key: a\r\n\r\n"


@pytest.mark.parametrize(
    ("request_", "status", "why"),
    [
        (b"GET /tap?token=%T " + UPGRADE, "101 Switching Protocols", ""),
        (b"GET /tap?token=wrong " + UPGRADE, "403 Forbidden", "the token is wrong"),
        (b"GET /tap " + UPGRADE, "403 Forbidden", "the token is wrong"),
        (b"GET /?token=%T " + UPGRADE, "404 Not Found", "there is `/tap` only"),
        (b"GET /tap?token=%T&rate=51 " + UPGRADE, "400 Bad Request", "`rate` must be more than 0"),
        (b"GET /tap?token=%T&rate=0 " + UPGRADE, "400 Bad Request", "`rate` must be more than 0"),
        (b"GET /tap?token=%T&rate=nan " + UPGRADE, "400 Bad Request", "at most 50 per second"),
        (b"GET /tap?token=%T&rate=x " + UPGRADE, "400 Bad Request", "at most 50 per second"),
        (b"POST /tap?token=%T " + UPGRADE, "405 Method Not Allowed", "a tap can be read only"),
        (b"GET /tap?token=%T HTTP/1.1\r\n\r\n", "426 Upgrade Required", "a tap speaks WebSocket"),
        (b"\x16\x03\x01 nonsense\r\n\r\n", "400 Bad Request", "this is not HTTP"),
        (b"GET /" + b"a" * 9000, "431 Request Header Fields Too Large", "is too long"),
    ],
)
def test_who_asks_for_something_else_is_told_so(
    tmp_path: Path, request_: bytes, status: str, why: str
) -> None:
    with Tap(share=1.0) as tap:
        tap.listen(tmp_path)
        request = request_.replace(b"%T", Place.read(tmp_path).token.encode())
        head, _, body = answer(tmp_path, request, tap).partition(b"\r\n\r\n")
    assert head.startswith(f"HTTP/1.1 {status}\r\n".encode())
    assert why.encode() in body


def test_those_who_say_nothing_do_no_harm(tap: Tap, clock: Clock, tmp_path: Path) -> None:
    """A hundred connections, and sixteen places: the silent ones are let go."""
    silent = [connected(tmp_path) for _ in range(16)]
    late: list[socket.socket] = []

    def pass_time(t: Time) -> None:
        clock.now += 0.021
        if t == 3000 * MS:
            late.append(asking(tmp_path, "fast.count"))

    run(tap, pass_time, steps=400)
    assert len(said(late[0])) > 90
    for each in silent:
        each.settimeout(5)
        assert each.recv(1) == b""


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such modes")
def test_only_who_started_the_run_can_read_the_token(tap: Tap, tmp_path: Path) -> None:
    file = tmp_path / FILE
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    url = json.loads(file.read_text())["url"]
    assert url == Place.read(tmp_path).url
    assert url.startswith("ws://127.0.0.1:")
    run(tap, steps=2)
    assert not file.exists()
    with pytest.raises(
        NoTapError, match="has no tap; a run has one that goes on, with `nlosim run"
    ):
        Place.read(tmp_path)


def test_an_error_of_the_tap_is_no_error_of_the_run(
    tap: Tap, clock: Clock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    def broken(*_: object) -> None:
        raise RuntimeError("no idea")

    connection = asking(tmp_path)
    monkeypatch.setattr(Watcher, "look", broken)
    with caplog.at_level(logging.WARNING):
        result = run(tap)
    assert result.status == "done"
    assert caplog.messages == ["the tap of this run is closed: RuntimeError: no idea"]
    with suppress(ConnectionResetError):  # its request was never read
        assert connection.recv(1) == b""


@pytest.mark.parametrize(
    ("error", "document"),
    [
        (ValueError("the moon"), {"status": "failed", "error": "the moon"}),
        (KeyboardInterrupt(), {"status": "interrupted", "error": "KeyboardInterrupt"}),
    ],
)
def test_readers_hear_how_a_run_ended(
    tap: Tap, clock: Clock, tmp_path: Path, error: BaseException, document: dict[str, str]
) -> None:
    connection = asking(tmp_path)

    def fail(t: Time) -> None:
        if t == 30 * MS:
            raise error

    with pytest.raises(type(error)):
        run(tap, fail)
    end = said(connection)[-1]
    assert (end.kind, end.t) == (Kind.END, 30 * MS)
    assert end.document == {**document, "ended_early": None}


def test_python_reads_along(tmp_path: Path) -> None:
    """While the run goes on; another one that reads the same is no hindrance."""
    with Tap(share=1.0) as tap:
        tap.listen(tmp_path)
        place = Place.read(tmp_path)
        ran = threading.Thread(target=run, args=(tap, lambda t: time.sleep(0.002)),
                               kwargs={"steps": 200})  # fmt: skip
        clients = []
        ran.start()
        for _ in range(2):
            client = TapClient(place, ["fast.*"], 50)
            clients.append(client)
        for client in clients:
            reader = Reader()
            found = [reader.decode(raw) for raw in client.messages(20)]
            assert [found[0].kind, found[-1].kind] == [Kind.SCHEMA, Kind.END]
            assert found[-1].t == 2000 * MS
            client.close()
        ran.join()
    with pytest.raises(NoTapError, match="nobody listens at the tap; the run has ended"):
        TapClient(place, ["*"], 10)


def test_python_is_told_why_it_is_refused(tmp_path: Path) -> None:
    with Tap(share=1.0) as tap:
        tap.listen(tmp_path)
        place = Place(Place.read(tmp_path).port, "wrong")
        ran = threading.Thread(target=run, args=(tap, lambda t: time.sleep(0.005)))
        ran.start()
        with pytest.raises(NoTapError, match="the run refused: the token is wrong"):
            TapClient(place, ["*"], 10)
        ran.join()


def test_reading_changes_no_byte_of_a_run(tmp_path: Path) -> None:
    """Nor does it leave a descriptor open."""
    before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").exists() else 0  # noqa: PTH208
    bits: list[list[Any]] = []
    for number in range(2):
        seen: list[Any] = []

        class Keep(Meanwhile):
            @override
            def observe(
                self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]
            ) -> None:
                for name, value in sorted(values["fast"].items()):
                    seen.append((t, name, bytes(value)))  # noqa: B023

        folder = tmp_path / str(number)
        folder.mkdir()
        with Tap(share=1.0) as tap:
            if number:
                tap.listen(folder)
                connection = asking(folder)
            system = System({"fast": Counter(3)}, {"fast": 10 * MS}, [])
            simulate(system, Jacobi(), start=0, stop=300 * MS, seed=1, observers=[tap, Keep(print)])
        bits.append(seen)
    assert said(connection)[-1].kind is Kind.END
    connection.close()
    assert bits[0] == bits[1]
    if before:
        assert len(os.listdir("/proc/self/fd")) == before  # noqa: PTH208
