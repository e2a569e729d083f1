"""Whoever waits for one host hears of the others, and a pause of the importer is nobody's fault."""

import importlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest
from typing_extensions import override

from orchestrator.errors import ComponentError
from orchestrator.limits import Deadlines
from orchestrator.randomness import stream
from orchestrator.remote import dialogue
from orchestrator.remote.dialogue import Company, Dialogue, HostLostError
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Link, LinkLostError


class Clock:
    """Time that passes only where a link waits."""

    now = 0.0


class ScriptedLink(Link):
    """Waits as long as it is told to; then says what it is told to."""

    def __init__(self, clock: Clock, says: Callable[[float], bytes | None]) -> None:
        self.slice_takes = 0.0
        self.is_abandoned = False
        self.last: Message | None = None
        self._clock, self._says = clock, says

    @override
    def send(self, message: bytes) -> None:
        self.last, _ = Message.decode(message)

    @override
    def receive(self, timeout: float) -> bytes:
        said = self._says(self._clock.now)
        if said is None:
            self._clock.now += max(timeout, self.slice_takes if timeout else 0.0)
            raise TimeoutError
        return said

    @override
    def abandon(self) -> None:
        self.is_abandoned = True

    @override
    def limit_memory(self, limit: int | None) -> None:
        pass

    def reply(self, kind: Kind = Kind.DONE, text: str = "") -> bytes:
        """To the command sent last."""
        assert self.last is not None
        failure = {"component": "", "time": None, "text": text, "is_type_error": False}
        document = {"failure": {**failure, "traceback": "T"}} if kind is Kind.FAILED else {}
        return self.last.reply(kind, document).encode()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    found = Clock()
    monkeypatch.setattr(dialogue, "monotonic", lambda: found.now)
    return found


def never(now: float) -> None:
    """Say nothing."""
    del now


def pair(
    clock: Clock, first: Callable[[float], bytes | None], second: Callable[[float], bytes | None]
) -> tuple[Dialogue, Dialogue]:
    company = Company()
    links = ScriptedLink(clock, first), ScriptedLink(clock, second)
    one, other = (Dialogue(n, each, company) for n, each in zip("ab", links, strict=True))
    return one, other


def test_a_host_that_hangs_is_named_while_another_is_waited_for(clock: Clock) -> None:
    """`b` may take 2 s and is asked after `a`, which may take 30 s: it is over after 2 s."""
    a, b = pair(clock, never, never)
    a.ask(Kind.STEP, 30.0, t=7, h=1)
    b.ask(Kind.STEP, 2.0, t=5, h=1)
    with pytest.raises(HostLostError, match=r"`b` at t = 5e-09 s: did not answer within 2 s"):
        a.answer()
    assert 2.0 <= clock.now <= 2.2
    assert (a.is_over, b.is_over) == (False, True)


@pytest.mark.parametrize("is_asked", [True, False])
def test_a_host_that_dies_is_named_while_another_is_waited_for(
    clock: Clock, *, is_asked: bool
) -> None:
    """Whether it works on something or not; the time is that of its step, or of the other's."""

    def dies(now: float) -> None:
        if now > 1.0:
            raise LinkLostError("is dead")

    a, b = pair(clock, never, dies)
    a.ask(Kind.STEP, 30.0, t=7, h=1)
    if is_asked:
        b.ask(Kind.STEP, 30.0, t=5, h=1)
    with pytest.raises(HostLostError) as caught:
        a.answer()
    assert str(caught.value) == f"component `b` at t = {5 if is_asked else 7}e-09 s: is dead"
    assert 1.0 <= clock.now <= 1.1


@pytest.mark.parametrize(("h", "who"), [(2, "b"), (3, "a")])
def test_an_error_counts_before_its_turn_unless_it_is_of_a_longer_step(
    clock: Clock, h: int, who: str
) -> None:
    """`a` steps to 2 ns. What `b` does beyond that may never be: the run may end there."""
    a, b = pair(clock, never, lambda _: b._link.reply(Kind.FAILED, "no"))  # type: ignore[attr-defined]
    a.ask(Kind.STEP, 3.0, t=1, h=1)
    b.ask(Kind.STEP, 3.0, t=0, h=h)
    with pytest.raises(ComponentError, match=f"component `{who}` at"):
        a.answer()
    if who == "a":
        with pytest.raises(ComponentError, match="component `b` at t = 0 s: no"):
            b.answer()


def test_who_has_answered_is_waited_for_no_longer(clock: Clock) -> None:
    """Its reply is kept, and what it has had of its time does not count any more."""
    a, b = pair(
        clock,
        lambda now: a._link.reply() if now > 5.0 else None,  # type: ignore[attr-defined]
        lambda _: b._link.reply(),  # type: ignore[attr-defined]
    )
    a.ask(Kind.STEP, 30.0)
    b.ask(Kind.STEP, 1.0)
    a.answer()
    assert b.answer().message.kind is Kind.DONE


@pytest.mark.parametrize("pause", [15.0, 3600.0])
def test_a_pause_of_this_process_counts_for_next_to_nothing(clock: Clock, pause: float) -> None:
    """A deadline of 2 s survives 19 pauses, each longer than that; the next one is too much."""
    a, _ = pair(clock, never, never)
    a._link.slice_takes = pause  # type: ignore[attr-defined]
    a.ask(Kind.STEP, 2.0)
    with pytest.raises(HostLostError, match="did not answer within 2 s"):
        a.answer()
    assert clock.now == 20 * pause


PACKAGES = Path(__file__).parent / "packages"


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`."""
    monkeypatch.syspath_prepend(PACKAGES)
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)


def test_a_death_during_the_step_of_another_is_noticed_at_once(runs: ModuleType) -> None:
    """`a` sleeps for 30 s, `b` is killed after half a second: less than 2 s pass, not 30."""
    values = {"deed": "sleep", "at": 1}
    specs = [
        ComponentSpec(name="a", type=runs.RECKLESS, values=values),
        ComponentSpec(name="b", type=runs.RECKLESS, values={}),
    ]
    with launch(specs, LocalTransport(), deadlines=Deadlines(step=60)) as components:
        for name, component in components.items():
            component.setup(0, stream(1, name))
            component.initialise({})
        victim = components["b"]
        victim.step({}, 0, 1)
        pid = int(victim.outputs()["pid"])
        kill = threading.Timer(0.5, os.kill, (pid, signal.SIGKILL))
        kill.start()
        before = time.monotonic()
        with pytest.raises(ComponentError, match=r"`b` at t = 0 s: .* was killed by SIGKILL"):
            components["a"].step({}, 0, 1)
        assert time.monotonic() - before < 2.5


@pytest.mark.parametrize(("kind", "expected"), [(Kind.DONE, True), (Kind.FAILED, False)])
def test_a_reply_that_has_come_is_known_without_waiting_for_it(
    clock: Clock, kind: Kind, *, expected: bool
) -> None:
    """An error is no reply that anybody could use before its turn; both stay until it."""
    a, _ = pair(clock, lambda now: a._link.reply(kind, "no") if now > 1.0 else None, never)  # type: ignore[attr-defined]
    assert not a.has_answered()  # it was not asked
    a.ask(Kind.STEP, 3.0, t=0, h=1)
    assert not a.has_answered()
    assert clock.now == 0.0
    clock.now = 2.0
    assert [a.has_answered(), a.has_answered()] == [expected, expected]
    if expected:
        assert a.answer().message.kind is Kind.DONE
    else:
        with pytest.raises(ComponentError, match="component `a` at t = 0 s: no"):
            a.answer()
    assert not a.has_answered()


@pytest.mark.parametrize("who", ["a", "b"])
def test_a_host_found_dead_when_asked_whether_it_is_done_is_named(clock: Clock, who: str) -> None:
    """When its turn comes, or as soon as another one is waited for, and once."""

    def dies(now: float) -> None:
        raise LinkLostError("is dead")

    a, b = pair(clock, never, dies)
    for each in (a, b):
        each.ask(Kind.STEP, 3.0, t=5, h=1)
    assert not b.has_answered()
    assert not b.has_answered()
    assert (b.is_over, a.is_over) == (True, False)
    with pytest.raises(HostLostError, match=r"component `b` at t = 5e-09 s: is dead"):
        (a if who == "a" else b).answer()
    assert clock.now < 0.2


def test_another_host_is_asked_like_the_first_one(clock: Clock) -> None:
    def dies(now: float) -> None:
        raise LinkLostError(f"is dead at {now:g}")

    _, b = pair(clock, never, dies)
    b.ask(Kind.STEP, 1.0, t=0, h=1)
    with pytest.raises(HostLostError, match="is dead"):
        b.answer()
    assert b.is_over
    other = ScriptedLink(clock, lambda _: other.reply())
    b.renew(other)
    assert not b.is_over
    b.ask(Kind.STEP, 1.0, t=0, h=1)
    assert b.answer().message.kind is Kind.DONE


def test_the_loss_of_a_host_that_can_be_renewed_is_no_matter_of_others(clock: Clock) -> None:
    def dies(now: float) -> None:
        raise LinkLostError("is dead")

    a, b = pair(clock, lambda now: a._link.reply() if now > 1.0 else None, dies)  # type: ignore[attr-defined]
    b.is_renewable = True
    for each in (a, b):
        each.ask(Kind.STEP, 3.0, t=5, h=1)
    assert not b.has_answered()
    assert a.answer().message.kind is Kind.DONE
    with pytest.raises(HostLostError, match="`b` at t = 5e-09 s: is dead"):
        b.answer()


def test_a_reply_that_has_come_counts_though_its_host_has_died_since(clock: Clock) -> None:
    said: list[bytes] = []

    def says(now: float) -> bytes:
        if said:
            raise LinkLostError("is dead")
        said.append(a._link.reply())  # type: ignore[attr-defined]
        return said[0]

    a, _ = pair(clock, says, never)
    a.ask(Kind.STEP, 3.0, t=5, h=1)
    assert [a.has_answered(), a.has_answered()] == [True, True]
    assert a.answer().message.kind is Kind.DONE
