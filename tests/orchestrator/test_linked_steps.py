"""Compiled code steps components in other processes as Python does: same bytes, same errors."""

import random
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.checkpoints import NoCheckpoints
from orchestrator.limits import Deadlines, Limits, OnFailure
from orchestrator.plan import layouts
from orchestrator.recording.reader import Recording
from orchestrator.remote.laid_out import PACKED
from orchestrator.remote.linked_steps import can_be_laid_out
from orchestrator.remote.protocol import HEADER_SIZE
from orchestrator.remote.segment import can_share
from orchestrator.remote.transport import Link, LoopbackTransport, Transport
from orchestrator.signal import Causality, Connector
from tests.orchestrator.mixers import (
    DEEDS,
    IN_TURN,
    KINDS,
    Members,
    Net,
    in_memory,
    link,
    packed,
)
from tests.ran import MS, check_equal

pytestmark = pytest.mark.skipif(
    not can_share() or layouts.engine() is None, reason="needs shared memory and the engine"
)


def drawn(seed: int) -> Net:
    """Some members, and what each reads."""
    dice = random.Random(seed)  # noqa: S311
    members: Members = [
        (True, dice.choice((1, 2, 3, 6, 18, 36)), {}) for _ in range(dice.randint(2, 4))
    ]
    members += [(False, dice.choice((4, 6, 9, 18)), {}) for _ in range(dice.randint(0, 2))]
    dice.shuffle(members)
    ways = []
    for target in range(len(members)):
        for kind in KINDS:
            if dice.random() < 0.8:
                way: dict[str, Any] = {}
                if kind in {"scalar", "table"} and dice.random() < 0.4:
                    way = dice.choice([{"gain": 0.25}, {"offset": 1.5}, {"delay": 3 * MS}])
                ways.append(link(dice.randrange(len(members)), target, kind, **way))
    return Net(members, ways)


FEW = range(4)


@pytest.mark.parametrize("seed", [
    pytest.param(k, marks=[] if k in FEW else [pytest.mark.slow]) for k in range(40)
])  # fmt: skip
def test_any_net_gives_the_bytes_of_one_process(seed: int, tmp_path: Path) -> None:
    """Whether they step at the same time, or in turns."""
    net = drawn(seed)
    order = [f"m{k}" for k in range(len(net.members))]
    random.Random(seed).shuffle(order)  # noqa: S311
    algorithm: CosimulationAlgorithm = GaussSeidel(tuple(order)) if seed % 2 else Jacobi()
    here = net.run(tmp_path / "here", elsewhere=False, algorithm=algorithm)
    assert not here.error
    for transport in (in_memory, packed):
        there = net.run(tmp_path / transport.__name__, algorithm=algorithm, transport=transport)
        check_equal(here, there)
    check_equal(here, net.run(tmp_path / "plain", compiled=False, algorithm=algorithm))


@pytest.mark.parametrize("transport", [in_memory, packed])
def test_steps_of_one_size_go_without_messages_of_signals(
    transport: Callable[[], Transport], tmp_path: Path, stretches: list[int], lengths: list[int]
) -> None:
    """Of 72 steps of three processes Python decodes no reply; it does of the calls around them."""
    ways = [link(k, (k + 1) % 3, kind) for k in range(3) for kind in KINDS]
    ran = Net([(True, 1, {})] * 3, ways).run(tmp_path / "run", transport=transport)
    assert (ran.error, ran.time) == ("", 72 * MS)
    assert sum(stretches) > 60  # a stretch that took too long leaves the last three to Python
    # created, set up, initialised, told of the memory, closed; a few that took longer than 50 ms
    assert len(lengths) < 3 * 5 + 3 * (72 - sum(stretches)) + 10


def test_a_slow_step_goes_on_while_others_are_due_and_python_steps_between(
    tmp_path: Path, stretches: list[int]
) -> None:
    """The slow one is begun by the engine, which leaves five times before it has to be ready."""
    ways = [link(0, 1, "scalar"), link(1, 0, "scalar"), link(2, 0, "table"), link(0, 2, "table")]
    members = [(True, 36, {"pause": 0.05}), (True, 1, {}), (False, 6, {})]
    here = Net(members, ways).run(tmp_path / "here", elsewhere=False)
    there = Net(members, ways).run(tmp_path / "there")
    check_equal(here, there)
    assert sum(stretches) > 40
    assert len(stretches) >= 12


@pytest.mark.parametrize("deed", [deed for deed in DEEDS if deed != "hang"])
@pytest.mark.parametrize(
    ("who", "algorithm", "transport"),
    [
        (0, Jacobi(), in_memory),
        (1, IN_TURN, packed),
        pytest.param(0, IN_TURN, in_memory, marks=pytest.mark.slow),
        pytest.param(1, Jacobi(), packed, marks=pytest.mark.slow),
    ],
)
def test_whatever_a_component_does_is_said_and_recorded_as_by_python(
    *,
    deed: str,
    who: int,
    algorithm: CosimulationAlgorithm,
    transport: Callable[[], Transport],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    stretches: list[int],
) -> None:
    if deed in {"leave", "die"} and who == 0:
        pytest.skip("when that is noticed depends on the machine")
    members: Members = [(True, 2, {}), (True, 1, {}), (False, 24, {})]
    members[who][2].update(deed=deed, at=7)
    ways = [link(k, (k + 1) % 3, kind) for k in range(3) for kind in KINDS]
    net = Net(members, ways)
    runs, logs = [], []
    for compiled in (False, True):
        caplog.clear()
        out = tmp_path / str(compiled)
        runs.append(net.run(out, compiled=compiled, algorithm=algorithm, transport=transport))
        logs.append([r.message for r in caplog.records if r.name == "mixer"])
    check_equal(*runs)
    assert sum(stretches) >= 4
    assert logs[0] == logs[1]
    assert logs[0] == ([f"at {(2, 1)[who] * 6 * MS}"] if deed == "log" else [])
    # of seven steps the last one begins at 6 ms or 12 ms, and nothing of its end is recorded
    step = (2, 1)[who]
    last = Recording(tmp_path / "True")[f"m{1 - who}.scalar_out"].times[-1]
    if runs[1].error:
        begin = f"component `m{who}` at t = {6 * step / 1000:g} s: "
        assert runs[1].error.startswith(begin)
        assert last == {0: 13, 1: 6}[who] * MS
    elif deed == "end":
        assert last == {0: 14, 1: 6}[who] * MS
    elif deed == "end_within":
        assert last == {0: 13, 1: 6}[who] * MS
    else:
        assert last == 72 * MS


@pytest.mark.parametrize("transport", [in_memory, packed])
def test_a_process_that_hangs_is_ended_at_its_deadline(
    transport: Callable[[], Transport], tmp_path: Path
) -> None:
    """Of three, while the others wait; what was published until then is recorded."""
    members: Members = [(True, 1, {}), (True, 1, {"deed": "hang", "at": 9}), (True, 1, {})]
    before = time.monotonic()
    ran = Net(members, []).run(tmp_path / "run", transport=transport)
    assert ran.error.startswith("component `m1` at t = 0.008 s: did not answer within 1 s")
    assert time.monotonic() - before < 15
    assert Recording(tmp_path / "run")["m0.scalar_out"].times[-1] == 8 * MS


@pytest.mark.parametrize("transport", [in_memory, packed])
def test_a_death_is_noticed_while_another_one_takes_its_time(
    transport: Callable[[], Transport], tmp_path: Path
) -> None:
    members: Members = [
        (True, 1, {"pause": 0.9}),
        (True, 1, {"deed": "die", "at": 1}),
        (True, 1, {}),
    ]
    before = time.monotonic()
    ran = Net(members, []).run(tmp_path / "run", stop=4 * MS, transport=transport)
    assert ran.error == "component `m1` at t = 0 s: its process was killed by SIGKILL"
    assert time.monotonic() - before < 15


@pytest.mark.parametrize("algorithm", [Jacobi(), IN_TURN], ids=["jacobi", "gauss-seidel"])
def test_who_is_not_due_where_python_steps_shows_what_he_showed(
    algorithm: CosimulationAlgorithm, tmp_path: Path, stretches: list[int]
) -> None:
    """Python steps at every ninth millisecond, at which the second one is not always due."""
    ways = [link(0, 1, "scalar"), link(2, 1, "table"), link(1, 0, "counts")]
    net = Net([(True, 2, {}), (True, 1, {}), (False, 9, {})], ways)
    here = net.run(tmp_path / "here", elsewhere=False, algorithm=algorithm)
    check_equal(here, net.run(tmp_path / "there", algorithm=algorithm))
    assert len(stretches) >= 8


def test_steps_that_are_written_down_for_checkpoints_stay_with_python(
    tmp_path: Path, stretches: list[int]
) -> None:
    """Of components whose state cannot be saved."""

    class Wanted(NoCheckpoints):
        are_wanted = True

    net = Net([(True, 1, {}), (True, 1, {})], [link(0, 1, "scalar")])
    plain = net.run(tmp_path / "plain", compiled=False)
    check_equal(plain, net.run(tmp_path / "run", checkpoints=Wanted()))
    assert not stretches


def test_what_comes_of_a_step_behind_the_end_is_no_matter(tmp_path: Path) -> None:
    """One that reads nobody has begun its next step when another one asks for the end."""
    members: Members = [(True, 1, {"deed": "raise_error", "at": 8}), (True, 1, {"deed": "end"})]
    members[1][2]["at"] = 7
    order = GaussSeidel(("m0", "m1"))
    for transport in (in_memory, packed):
        ran = Net(members, []).run(
            tmp_path / transport.__name__, algorithm=order, transport=transport
        )
        assert (ran.error, ran.time) == ("", 7 * MS)


class Stuttering(LoopbackTransport):
    """Gives every reply twice, as one that is said again after a cut."""

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        return {name: Stutter(link) for name, link in super().open(names, timeout).items()}


class Stutter(Link):
    """See `Stuttering`."""

    packs = True

    def __init__(self, link: Link) -> None:
        self._link = link
        self._replies: list[bytes] = []

    @override
    def send(self, message: bytes) -> None:
        self._link.send(message)
        self._replies += [self._link.receive(0.0)] * 2

    @override
    def receive(self, timeout: float) -> bytes:
        if not self._replies:
            raise TimeoutError
        return self._replies.pop(0)

    @override
    def abandon(self) -> None:
        self._link.abandon()

    @override
    def limit_memory(self, limit: int | None) -> None:
        self._link.limit_memory(limit)


class Garble(Stutter):
    """Gives replies as they are, but for the sixth with packed outputs.

    Args:
        link: to a host.
        what: is put in the place of what says that they are packed.
        more: is put behind them.
    """

    def __init__(self, link: Link, what: bytes, more: bytes) -> None:
        super().__init__(link)
        self._what, self._more, self._packed = what, more, 0

    @override
    def send(self, message: bytes) -> None:
        self._link.send(message)
        reply, end = self._link.receive(0.0), HEADER_SIZE + len(PACKED)
        self._packed += reply[HEADER_SIZE:end] == PACKED
        if self._packed == 6:
            reply = reply[:HEADER_SIZE] + self._what + reply[end:] + self._more
        self._replies.append(reply)


@pytest.mark.parametrize(
    ("what", "more", "error"),
    [
        (bytes(len(PACKED)), b"", "the signals end at byte 64 of 120"),
        (PACKED, bytes(16), "outputs of 72 bytes, not 56"),
    ],
    ids=["not packed", "longer"],
)
def test_only_what_is_as_agreed_is_taken_for_outputs(
    tmp_path: Path, what: bytes, more: bytes, error: str
) -> None:
    class Garbling(LoopbackTransport):
        @override
        def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
            return {n: Garble(each, what, more) for n, each in super().open(names, timeout).items()}

    net = Net([(True, 1, {}), (True, 1, {})], [link(0, 1, "scalar")])
    ran = net.run(tmp_path / "there", transport=Garbling)
    unreadable = "its process sent something unreadable"
    assert ran.error == f"component `m0` at t = 0.005 s: {unreadable}: {error}"


def test_a_reply_that_is_said_again_is_not_that_of_the_next_step(tmp_path: Path) -> None:
    net = Net([(True, 1, {}), (True, 2, {})], [link(0, 1, "scalar"), link(1, 0, "table")])
    here = net.run(tmp_path / "here", elsewhere=False)
    check_equal(here, net.run(tmp_path / "there", transport=Stuttering))


def test_signals_in_between_change_nothing(tmp_path: Path) -> None:
    """They interrupt whoever sends or waits, here some thousand times."""
    heard: list[int] = []
    net = Net([(True, 1, {}), (True, 1, {}), (True, 2, {})], [link(0, 1, "table")])
    here = net.run(tmp_path / "here", elsewhere=False, stop=720 * MS)
    before = signal.signal(signal.SIGALRM, lambda number, frame: heard.append(number))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.0003, 0.0003)
        there = net.run(tmp_path / "there", stop=720 * MS)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    check_equal(here, there)
    assert len(heard) > 100


def test_a_component_that_may_be_started_again_stays_with_python(
    tmp_path: Path, stretches: list[int]
) -> None:
    """Its steps are written down, to be made again."""
    net = Net([(True, 1, {}), (True, 1, {})], [])
    again = {"m0": Limits(deadlines=Deadlines(), on_failure=OnFailure.RESTART)}
    plain = net.run(tmp_path / "plain", compiled=False)
    check_equal(plain, net.run(tmp_path / "run", limits=again))
    assert not stretches
    check_equal(plain, net.run(tmp_path / "usual"))
    assert sum(stretches) > 60


@pytest.mark.parametrize(
    ("ways", "one", "other", "ahead"),
    [
        pytest.param([(0, 1), (0, 2)], "m2", "m1", 0, id="who do not read each other"),
        pytest.param([(0, 1), (1, 2)], "m0", "m2", 1, id="who reads nobody, with its next step"),
    ],
)
def test_in_turns_they_work_at_the_same_time(
    *,
    ways: list[tuple[int, int]],
    one: str,
    other: str,
    ahead: int,
    tmp_path: Path,
    stretches: list[int],
) -> None:
    """`one` has begun its step, or the next one, before that of `other` ends; of 12, most."""
    log = tmp_path / "log"
    log.mkdir()
    members: Members = [(True, 1, {"pause": 0.04, "log": log / f"m{k}"}) for k in range(3)]
    net = Net(members, [link(*way, "scalar") for way in ways])
    ran = net.run(tmp_path / "there", algorithm=IN_TURN, stop=12 * MS)
    assert not ran.error
    assert sum(stretches) > 6
    times = {name: np.loadtxt(log / name) for name in (one, other)}
    begun, ended = times[one][ahead:, 0], times[other][: 12 - ahead, 1]
    assert np.count_nonzero(begun < ended) > 6


def test_in_turns_nobody_sees_more_than_in_one_process(tmp_path: Path) -> None:
    """Who leads and steps less often, who follows and steps more often, rings of both, chains."""
    ring = [link(a, b, "scalar") for a, b in [(0, 1), (1, 2), (2, 0)]]
    ring += [link(2, 1, "table"), link(1, 2, "counts")]
    chain = [link(0, 1, "scalar"), link(1, 2, "scalar")]
    nets = [((1, 2, 3), ring), ((3, 2, 1), ring), ((6, 1, 1), ring), ((3, 1, 2), chain)]
    nets += [((12, 1, 2), chain)]  # the first one is stepped by Python
    for k, (rates, ways) in enumerate(nets):
        net = Net([(rate < 12, rate, {}) for rate in rates], ways)
        here = net.run(tmp_path / f"here{k}", algorithm=IN_TURN, elsewhere=False)
        check_equal(here, net.run(tmp_path / f"there{k}", algorithm=IN_TURN))


def test_what_is_too_much_or_not_of_fixed_size_is_not_laid_out() -> None:
    def declared(**of: Any) -> dict[str, Connector]:
        return {"x": Connector(**{"causality": Causality.OUTPUT, **of})}

    assert can_be_laid_out(declared(shape=(131072,)))  # 1 MB
    assert not can_be_laid_out(declared(shape=(131073,)))
    assert not can_be_laid_out(declared(shape=("car",)))
    assert not can_be_laid_out(declared(shape=(3,), dtype=np.complex128))
    assert not can_be_laid_out(declared(dtype=None, mime_type="text/plain"))
    half = declared(shape=(65536,))["x"]
    assert can_be_laid_out({"a": half, "b": half})
    assert not can_be_laid_out({"a": half, "b": half, "c": declared()["x"]})
