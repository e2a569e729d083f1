"""The benchmark of distributed runs: all participants compute the same ring, and say how long."""

import dataclasses
import json
import signal
import socket
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import numpy as np
import pytest
from typing_extensions import override

from benchmarks.benchmark import Measurement, PeerFailedError
from benchmarks.distributed import benchmark
from benchmarks.distributed.benchmark import (
    OURS,
    PARTICIPANTS,
    RINGS,
    TARGET_MS,
    DistributedBenchmark,
    target_ratio,
)
from benchmarks.distributed.children import BrokenProcessError, ended, hear, killed, spawn
from benchmarks.distributed.helics import first_free_port
from benchmarks.distributed.participant import Participant, RingRun
from benchmarks.distributed.ring import PARALLEL, SEQUENTIAL, DifferentValuesError, Ring, timing
from benchmarks.distributed.worker import HEAD, answer
from benchmarks.settings import WholeNumberError
from orchestrator.cli import main
from tests.benchmarks.schema import ONE

STEPS = 12


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTICIPANTS)
@pytest.mark.parametrize("algorithm", [PARALLEL, SEQUENTIAL])
def test_all_participants_give_the_same(name: str, algorithm: str) -> None:
    """A run compares every element of every member with what it should be."""
    participant = PARTICIPANTS[name]
    if participant.why_not:
        pytest.skip(participant.why_not)
    stamps = participant.stamps(Ring(4096, algorithm, 3), STEPS)
    assert len(stamps) == STEPS + 1
    assert all(np.diff(np.asarray(stamps)) > 0)


def test_a_peer_whose_processes_fail_is_left_out_by_name() -> None:
    """As when a federate cannot connect; the last line says why."""

    class Failing(Participant):
        label = "HELICS"

        @override
        def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
            program = spawn("benchmarks.distributed.helics", ["nonsense"])
            with ended([program]):
                hear(program)
            raise AssertionError

    run = RingRun(participant=Failing(), ring=Ring(256, PARALLEL, 3), steps=STEPS)
    with pytest.raises(PeerFailedError, match=r"^HELICS failed: IndexError: list index out of"):
        run.measure()


def test_federates_get_ports_that_no_connection_has() -> None:
    """All in a row can be bound; with one of them taken it is another row."""
    with ExitStack() as opened:
        first = first_free_port(18)
        for port in range(first, first + 18):
            opened.enter_context(socket.socket()).bind(("127.0.0.1", port))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", first + 17))
        assert first_free_port(18) > first + 17
    limits = Path("/proc/sys/net/ipv4/ip_local_port_range")
    assert not limits.exists() or first + 18 <= int(limits.read_text().split()[0])
    with pytest.raises(BrokenProcessError, match="there are no 8000 free ports in a row"):
        first_free_port(8000)


@pytest.mark.parametrize("members", [2, 5])
def test_the_last_values_are_those_of_a_loop(members: int) -> None:
    """At once all see what was there before; in turns each sees what the one before has made."""
    for steps in (1, 7):
        ring = Ring(24, PARALLEL, members)
        values = [ring.start(member) for member in range(members)]
        for _ in range(steps):
            values = [values[member - 1] + 1.0 for member in range(members)]
        assert all(ring.is_last(member, value, steps) for member, value in enumerate(values))
        ring = dataclasses.replace(ring, algorithm=SEQUENTIAL)
        values = [ring.start(member) for member in range(members)]
        for _ in range(steps):
            for member in range(members):
                values[member] = values[member - 1] + 1.0
        assert all(ring.is_last(member, value, steps) for member, value in enumerate(values))


def test_a_single_wrong_element_is_refused() -> None:
    ring = Ring(256, PARALLEL, 3)
    wrong = ring.last(1, 5)
    wrong[-1] = np.nextafter(wrong[-1], 0.0)
    right = [ring.is_last(0, ring.last(0, 5), 5), ring.is_last(1, wrong, 5)]
    assert right == [True, False]
    with pytest.raises(DifferentValuesError, match=r"256B: we gave other .* 5 steps: members 1, 2"):
        ring.check("we", right, 5)
    ring.check("we", [True, True, True], 5)


def test_a_ring_travels_as_text() -> None:
    ring = Ring(12800, SEQUENTIAL, 20)
    assert Ring.from_text(ring.to_text()) == ring
    assert ring.name == "20-gauss-seidel/12800B"


def test_what_steps_took() -> None:
    """Nine steps of 1 ms and one of 11 ms."""
    stamps = [step * 1_000_000 for step in range(10)] + [20_000_000]
    found = timing(stamps)
    assert found["mean_ms"] == pytest.approx(2.0)
    assert found["median_ms"] == pytest.approx(1.0)
    assert found["p99_ms"] == pytest.approx(11.0 - 0.09 * 10.0)


def test_a_worker_adds_one() -> None:
    message = HEAD.pack(3) + np.array([1.0, -2.0]).tobytes()
    assert answer(message) == HEAD.pack(3) + np.array([2.0, -1.0]).tobytes()


def test_a_process_that_breaks_is_heard() -> None:
    with (
        pytest.raises(
            BrokenProcessError, match=r"(?s)nothing.* ended early: .*KeyError: 'nothing'"
        ),
        ended([process := spawn("benchmarks.distributed.worker", ["nothing"])]),
    ):
        hear(process)


def test_a_process_that_is_silent_is_killed() -> None:
    """As federates of HELICS that wait for one that has gone; else nobody else was measured."""
    process = spawn("http.server", ["--bind", "127.0.0.1", "0"])
    with killed([process]):
        with pytest.raises(BrokenProcessError, match=r"http\.server.* said nothing for 1 s"):
            hear(process, 1.0)
        assert process.wait() == -signal.SIGKILL


def test_rows_compare_each_of_ours_with_its_peers(monkeypatch: pytest.MonkeyPatch) -> None:
    every = {f"{ring.name}/{name}" for ring in RINGS for name in PARTICIPANTS}
    measured: dict[str, list[Measurement]] = {
        name: [
            {
                "mean_ms": n * (1.0 if name.endswith(("/local", "/zenoh")) else 8.0),
                "median_ms": 0.5 * n,
                "p99_ms": 10.0 * n,
            }
            for n in (1, 2, 9)
        ]
        for name in every
    }
    rows = {row.case: row for row in DistributedBenchmark().rows(measured)}
    assert set(rows) == {
        f"{ring.name}/{ours}/{peer}" for ring in RINGS for ours in OURS for peer in OURS[ours]
    }
    row = rows["5-jacobi/102400B/local/helics"]
    assert (row.ours, row.low, row.high, row.peer, row.ratio) == (2.0, 1.0, 9.0, 16.0, 8.0)
    assert (row.peer_name, row.unit, row.is_higher_better) == ("HELICS", "ms / step", False)
    assert row.details == {
        "target_ratio": 2.0, "target_ms": TARGET_MS, "median_ms": 1.0, "p99_ms": 20.0,
        "peer_median_ms": 1.0, "peer_p99_ms": 20.0, "peer_low_ms": 8.0, "peer_high_ms": 72.0,
    }  # fmt: skip
    aimed = [name for name in rows if "target_ms" in rows[name].details]
    assert aimed == [
        f"5-jacobi/{size}B/local/{peer}" for size in (256, 12800, 102400) for peer in OURS["local"]
    ]
    alone = {name: runs for name, runs in measured.items() if name.endswith("/local")}
    found = DistributedBenchmark().rows(alone)
    assert [row.case for row in found] == [f"{ring.name}/local" for ring in RINGS]
    assert all(row.ratio is None for row in found)


def test_what_is_aimed_at() -> None:
    """Half of HELICS, 2.5 times ZeroMQ over Zenoh, 1.5 times ZeroMQ with fifty."""
    five, fifty = Ring(256, PARALLEL), Ring(12800, PARALLEL, 50)
    assert target_ratio(five, "local", "helics") == 2.0
    assert target_ratio(five, "zenoh", "zeromq") == 0.4
    assert target_ratio(five, "local", "zeromq") is None
    assert target_ratio(fifty, "local", "zeromq") == pytest.approx(0.667, abs=1e-3)
    assert target_ratio(fifty, "zenoh", "zeromq") is None


def test_who_is_left_out_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    class Absent(type(PARTICIPANTS["helics"])):  # type: ignore[misc]
        why_not = "`helics` is not installed"

    monkeypatch.setattr(benchmark, "PARTICIPANTS", {**PARTICIPANTS, "helics": Absent()})
    found = DistributedBenchmark()
    assert "; left out: HELICS (`helics` is not installed)" in found.peer
    assert not any(name.endswith("/helics") for name in found.cases())


def test_the_number_of_steps_can_be_set() -> None:
    """Large arrays, many members and slow peers make fewer."""
    made = DistributedBenchmark()
    made.configure({"steps": "1000"})
    assert made.settings == {"steps": "1000"}
    cases = made.cases()
    for name, steps in {
        "5-jacobi/256B/local": 1000,
        "5-gauss-seidel/1048576B/pipe": 200,
        "50-jacobi/12800B/zenoh": 100,
    }.items():
        case = cases[name]
        assert isinstance(case, RingRun)
        assert case.steps == steps
    large = {name.rpartition("/")[2] for name in cases if not name.startswith("5-")}
    assert large <= {"local", "zenoh", "zeromq", "helics"}
    assert "50-jacobi/12800B/helics" not in cases
    with pytest.raises(WholeNumberError, match=r"`steps` is `19`; write a whole number from 20 on"):
        made.configure({"steps": "19"})


@pytest.mark.slow
def test_the_command_measures_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmark, "RINGS", (Ring(256, PARALLEL, 5),))
    only = {name: PARTICIPANTS[name] for name in ("local", "pipe")}
    monkeypatch.setattr(benchmark, "PARTICIPANTS", only)
    arguments = ["distributed", "--set", "steps=20", "--repeat", "1", "--json"]
    assert main(["bench", *arguments]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, ONE)
    assert [row["case"] for row in found["rows"]] == ["5-jacobi/256B/local/pipe"]
