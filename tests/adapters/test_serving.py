"""Who serves components ends when it is told to, whatever the runs that use them do."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typing_extensions import override

from orchestrator.errors import ComponentError
from orchestrator.network import Records, Visit
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.scenario.build import load_scenario
from orchestrator.serving.server import STOPPED, Server
from orchestrator.serving.stand import Stand
from tests.adapters.hosting import SCENARIO, Site, free_port, until

REQUEST = {"run": "0123456789abcdef", "name": "ring", "patience": 60.0}


class BusyRun(Visit):
    """A run whose next command is there as soon as the last one was answered.

    Args:
        listens: whether it leaves when it is told that the component is lost.
    """

    def __init__(self, *, listens: bool) -> None:
        self._listens = listens
        self._sequence = 0
        self.has_left = False
        self.answered = 0
        self.told: list[str] = []

    @property
    @override
    def absence(self) -> float:
        return 0.0

    @property
    @override
    def is_over(self) -> bool:
        return self._listens and bool(self.told)

    @override
    def receive(self, timeout: float) -> bytes:
        self._sequence += 1
        if self.has_left:
            return b""
        return Message(kind=Kind.CREATE, epoch=0, sequence=self._sequence).encode()

    @override
    def send(self, reply: bytes) -> None:
        self.answered += 1

    @override
    def lose(self, how: str) -> None:
        self.told.append(how)

    @override
    def log(self, records: Records) -> None:
        pass

    @override
    def close(self) -> None:
        pass


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path / "site", SCENARIO, {"gpu": free_port(), "partner": free_port()})


@contextmanager
def serving(site: Site, said: list[str]) -> Iterator[Server]:
    with LoopbackTransport() as transport:
        stand = Stand("far", lambda: load_scenario(site.scenario), transport)
        stand.prepare()
        with Server([stand], said.append) as server:
            yield server


@pytest.mark.parametrize("listens", [True, False])
def test_a_server_ends_while_a_run_never_lets_it_wait(
    site: Site, monkeypatch: pytest.MonkeyPatch, *, listens: bool
) -> None:
    """Also if the run does not listen; it is told again and again then."""
    monkeypatch.setattr("orchestrator.serving.server._LISTENED", 0.2)
    said: list[str] = []
    run = BusyRun(listens=listens)
    entered = serving(site, said)
    server = entered.__enter__()
    assert server.welcome("far", REQUEST, run)
    assert until(lambda: run.answered > 100)
    ending = threading.Thread(target=entered.__exit__, args=(None, None, None), daemon=True)
    ending.start()
    ending.join(20)
    has_ended, run.has_left = not ending.is_alive(), True
    assert has_ended  # it never would, if it looked only while it waits
    assert set(run.told) == {STOPPED}
    assert said == ["`far`: the run `ring` has come", f"`far` was lost: {STOPPED}"]


def test_who_comes_while_a_server_ends_is_not_welcome(site: Site) -> None:
    run = BusyRun(listens=True)
    with serving(site, []) as server:
        pass
    assert not server.welcome("far", REQUEST, run)
    assert run.answered == 0


def test_a_defect_loses_the_component_and_the_run_hears_of_it(site: Site) -> None:
    class Broken(BusyRun):
        @override
        def send(self, reply: bytes) -> None:
            raise RuntimeError("the network is on fire")

    said: list[str] = []
    run = Broken(listens=True)
    with serving(site, said) as server:
        assert server.welcome("far", REQUEST, run)
        assert server.next_end(10) is not None
    assert run.told == ["RuntimeError: the network is on fire"]
    assert said[-1] == "`far` was lost: RuntimeError: the network is on fire"


def test_a_component_that_is_being_created_is_left_at_once(site: Site) -> None:
    """No thread is left: what is in native code when Python ends would abort the process."""
    site.scenario.write_text(site.scenario.read_text().replace("rate: 2", "deed: dawdle"))
    with LocalTransport(shares=False) as transport:
        stand = Stand("far", lambda: load_scenario(site.scenario), transport)
        stand.prepare_aside()
        assert until(lambda: stand._making is not None)
        assert "far creation" in thread_names()
        before = time.monotonic()
        stand.close()
        assert time.monotonic() - before < 20  # creating it takes 60 s
        assert "far creation" not in thread_names()
        assert stand.ready is None


def thread_names() -> list[str]:
    return [thread.name for thread in threading.enumerate()]


@pytest.mark.slow
def test_a_server_that_ends_before_the_run_begins_is_waited_for_anew(site: Site) -> None:
    """The run holds `far` and `apart` while it waits for `near`; then their server is another."""
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    expected = site.run("here", away=False).fingerprint
    lines: list[str] = []
    found: list[str] = []

    def run() -> None:
        try:
            found.append(site.run("hosts", tell=lines.append).fingerprint)
        except ComponentError as error:
            found.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    with site.serving("partner", "far", "apart") as said:
        assert until(lambda: len(said) == 2)
        before = time.monotonic()
    assert time.monotonic() - before < 5
    assert sorted(said[2:]) == [f"`{name}` was lost: {STOPPED}" for name in ("apart", "far")]
    assert until(lambda: any("`far`: nobody answers at host `partner`" in line for line in lines))
    with site.serving("partner", "far", "apart"), site.serving("gpu", "near"):
        thread.join(30)
    assert found == [expected]
