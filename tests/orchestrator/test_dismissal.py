"""Hosts that are needed no more leave in their own way, all of them within one time."""

from collections.abc import Callable

import pytest
from typing_extensions import override

from orchestrator.remote import transport
from orchestrator.remote.transport import GRACE, ProcessLink, dismiss


class Leaving(ProcessLink):
    """Its host takes `takes` [s] to leave, from when it is told."""

    def __init__(self, log: list[str], name: str, takes: float, clock: list[float]) -> None:
        self._say: Callable[[str], None] = lambda what: log.append(f"{what} {name}")
        self._takes, self._clock = takes, clock
        self.allowed = -1.0

    @override
    def send(self, message: bytes) -> None:
        raise NotImplementedError

    @override
    def receive(self, timeout: float) -> bytes:
        raise NotImplementedError

    @override
    def dismiss(self) -> None:
        self._say("dismiss")
        self._leaves_at = self._clock[0] + self._takes

    @override
    def has_left(self, timeout: float) -> bool:
        self._say("await")
        self.allowed = timeout
        rest = max(0.0, self._leaves_at - self._clock[0])
        self._clock[0] += min(rest, timeout)
        return rest <= timeout

    @override
    def abandon(self) -> None:
        self._say("abandon")


@pytest.mark.parametrize(
    ("takes", "allowed", "lasts"),
    [
        ((9.0, 9.0, 9.0), (GRACE, 0.0, 0.0), GRACE),
        ((0.3, 0.1, 9.0), (GRACE, GRACE - 0.3, GRACE - 0.3), GRACE),
        ((0.1, 0.2, 0.3), (GRACE, GRACE - 0.1, GRACE - 0.2), 0.3),
    ],
)
def test_all_hosts_have_one_time_of_grace_together(
    takes: tuple[float, ...],
    allowed: tuple[float, ...],
    lasts: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Who hangs takes none of it from the others' leaving, and adds nothing: a hundred hosts that
    hang are ended after half a second."""
    clock, log = [100.0], []  # type: tuple[list[float], list[str]]
    monkeypatch.setattr(transport, "monotonic", lambda: clock[0])
    links = [Leaving(log, n, each, clock) for n, each in zip("abc", takes, strict=True)]
    dismiss(links)
    assert [link.allowed for link in links] == pytest.approx(list(allowed))
    assert clock[0] - 100.0 == pytest.approx(lasts)
    assert log == [f"{what} {n}" for what in ("dismiss", "await", "abandon") for n in "abc"]
