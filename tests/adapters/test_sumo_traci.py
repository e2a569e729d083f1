"""SUMO over TraCI: the same bytes as in this process, and a sentence for all that can go wrong."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from adapters.sumo import SumoTraffic, connection
from adapters.sumo.entities import Entity, Position, Synchronise, Trigger, Vertex
from adapters.sumo.errors import SumoError
from adapters.sumo.headless import with_stand_ins
from adapters.sumo.parameters import Background, TrafficParameters
from orchestrator.distribution import Constant
from orchestrator.errors import ParameterError
from orchestrator.randomness import stream
from tests.adapters.sumo_runs import BRAKE, RED_LIGHT, Command, H, Run, car, on, scene, simulate
from tests.adapters.test_sumo_census import BLOCKED, TOWN_DEMAND, TOWN_EXTRA

pytest.importorskip("sumo", reason="the package eclipse-sumo, with SUMO's programs")
traci = pytest.importorskip("traci")

PEDESTRIAN = "DEFAULT_PEDTYPE"

CAST = {
    "ego": car("east_1_0", 60.0, speed=Constant(8.0), controller="policy"),
    "meets": car("north_1_0", 60.0, speed=Constant(8.0), synchronise=Synchronise(entity="ego")),
    "foot": Entity(
        type=PEDESTRIAN,
        position=Position(x=-30.0, y=6.0),
        trajectory=(Vertex(time=4.0, x=-30.0, y=-6.0),),
        trigger=Trigger(entity="ego", closer_than=60.0),
    ),
    "late": car("west_1_0", 60.0, speed=Constant(8.0), enters=1.0),
    "parked": car("west_2_0", 60.0, parked=True),
    "van": Entity(type="van", position=Position(x=30.0, y=-8.0)),
}


def assert_same(one: Run, other: Run) -> None:
    """Equal bytes of everything at every communication point."""
    assert len(one.points) == len(other.points)
    for k, (a, b) in enumerate(zip(one.points, other.points, strict=True)):
        assert a.keys() == b.keys()
        for name in a:
            left, right = np.asarray(a[name]), np.asarray(b[name])
            assert left.dtype == right.dtype
            assert left.tobytes() == right.tobytes(), f"{name} at {k}"


def test_a_town_is_the_same_in_this_process_and_over_a_socket(tmp_path: Path) -> None:
    """With persons who walk and ride, bicycles, a tram, lights, and one who parks."""
    path = scene(tmp_path, "town", TOWN_DEMAND, extra=TOWN_EXTRA)
    run = simulate(path, 150.0)
    assert run.array(0, "light.state").size > 0
    assert len({run.array(k, "light.state").tobytes() for k in range(1501)}) > 1
    assert list(run.name.values()).count("rider") == 2
    assert_same(run, simulate(path, 150.0, program="sumo"))


def test_teleports_are_the_same_over_a_socket(tmp_path: Path) -> None:
    options = '<processing><time-to-teleport value="3"/></processing>'
    path = scene(tmp_path, demand=BLOCKED, options=options)
    run = simulate(path, 20.0)
    assert list(run.name.values()).count("b") == 2
    assert_same(run, simulate(path, 20.0, program="sumo"))


def test_entities_are_the_same_over_a_socket(tmp_path: Path) -> None:
    path = scene(tmp_path)

    def policy(t: float) -> Mapping[str, Command]:
        return {"ego": BRAKE} if t > 6.0 else {}

    run = simulate(path, 10.0, CAST, policy=policy)
    assert set(run.number) == set(CAST)
    assert_same(run, simulate(path, 10.0, CAST, policy=policy, program="sumo"))


def test_the_background_is_the_same_over_a_socket() -> None:
    entity = Entity(
        type="sedan",
        position=on("south_in_1", to_end=100.0),
        speed=Constant(8.0),
        controller="policy",
    )
    runs = [
        simulate(RED_LIGHT, 10.0, {"ego": entity}, background=Background(), program=program)
        for program in ("libsumo", "sumo")
    ]
    assert len(runs[0].number) > 50
    assert_same(*runs)


def test_one_process_holds_several_that_run_elsewhere_but_one_of_its_own(tmp_path: Path) -> None:
    def traffic(program: Literal["libsumo", "sumo"]) -> SumoTraffic:
        path = scene(tmp_path)
        return SumoTraffic(TrafficParameters(scene=path, step_length=0.1, program=program))

    with ExitStack() as stack:
        several = [stack.enter_context(closing(traffic("sumo"))) for _ in range(2)]
        for each in several:
            each.setup(0, stream(1, "traffic"))
        for each in several:
            each.step({}, 0, H)
        own, another = (stack.enter_context(closing(traffic("libsumo"))) for _ in range(2))
        own.setup(0, stream(1, "traffic"))
        with pytest.raises(SumoError, match="SUMO can run once per process"):
            another.setup(0, stream(1, "traffic"))


def free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("localhost", 0))
        return int(probe.getsockname()[1])


@contextmanager
def listening(path: Path, step: str = "0.1") -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A SUMO of its own, and where it listens; it waits for its client."""
    port = free_port()
    program = connection._installed("sumo")
    options = ["--step-length", step, "--seed", "7", "--no-step-log", "--no-warnings"]
    command = [program, "-c", str(path), "--remote-port", str(port), *options]
    process = subprocess.Popen(
        command,
        env=with_stand_ins(os.environ),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    with process:
        try:
            yield f"localhost:{port}", process
        finally:
            process.kill()


def test_a_sumo_that_runs_already_is_joined_and_ends_with_the_run(tmp_path: Path) -> None:
    """It gives what SUMO in this process gives with its seed."""
    path = scene(tmp_path, "town", TOWN_DEMAND, extra=TOWN_EXTRA)
    with listening(path) as (address, process):
        joined = simulate(path, 20.0, traci=address)
        assert process.wait(timeout=5.0) == 0
    assert_same(joined, simulate(path, 20.0, sumo_seed=7))


def test_a_sumo_with_another_step_is_not_joined(tmp_path: Path) -> None:
    path = scene(tmp_path)
    with listening(path, "0.05") as (address, _), pytest.raises(SumoError) as caught:
        simulate(path, 1.0, traci=address)
    assert str(caught.value) == (
        f"SUMO at {address} steps every 0.05 s, the scenario every 0.1 s; start SUMO with "
        "--step-length 0.1 or set `step_length` to 0.05 s"
    )


def test_nobody_there(tmp_path: Path) -> None:
    port, began = free_port(), time.monotonic()
    with pytest.raises(SumoError, match=f"^no SUMO answers at localhost:{port} .*; start one with"):
        simulate(scene(tmp_path), 1.0, traci=f"localhost:{port}")
    assert time.monotonic() - began < 10.0


@pytest.mark.parametrize(
    "address", ["localhost", ":8813", "localhost:", "localhost:http", "h:70000"]
)
def test_an_address_is_host_and_port(tmp_path: Path, address: str) -> None:
    with pytest.raises(ParameterError) as caught:
        simulate(scene(tmp_path), 1.0, traci=address)
    assert str(caught.value) == (
        f"`traci`: is `{address}`; write HOST:PORT, for example localhost:8813"
    )


def test_a_host_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(SumoError, match=r"^no SUMO answers at nowhere\.invalid:8813 "):
        simulate(scene(tmp_path), 1.0, traci="nowhere.invalid:8813")


@pytest.mark.parametrize("what", [{}, CAST], ids=["nobody", "entities"])
def test_a_sumo_that_dies_is_said_at_once(tmp_path: Path, what: Mapping[str, Entity]) -> None:
    """In the next step, whatever it asks SUMO for first; closing then is harmless."""
    path = scene(tmp_path)
    with listening(path) as (address, process):
        parameters = TrafficParameters(scene=path, step_length=0.1, traci=address, entities=what)
        with closing(SumoTraffic(parameters)) as traffic:
            traffic.setup(0, stream(1, "traffic"))
            inputs: dict[str, Any] = {"ego.command": np.zeros(3)} if what else {}
            traffic.step(inputs, 0, H)
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            began = time.monotonic()
            with pytest.raises(SumoError, match=f"^SUMO at {address} is gone"):
                traffic.step(inputs, H, H)
            assert time.monotonic() - began < 5.0


def test_a_scene_that_sumo_refuses_is_refused_over_a_socket_too(tmp_path: Path) -> None:
    path = tmp_path / "broken.sumocfg"
    path.write_text('<configuration><net-file value="missing.net.xml"/></configuration>')
    with pytest.raises(SumoError, match="SUMO did not start"):
        simulate(path, 1.0, program="sumo")


def test_a_program_that_is_not_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "find_spec", lambda name: None if name == "sumo" else True)
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SumoError) as caught:
        simulate(scene(tmp_path), 1.0, program="sumo")
    assert str(caught.value) == (
        "`sumo` is not installed; run `pip install eclipse-sumo`, or install SUMO and set SUMO_HOME"
    )


def test_a_program_may_lie_in_sumo_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home = Path(connection._installed("sumo")).parents[1]
    monkeypatch.setattr(connection, "find_spec", lambda name: None if name == "sumo" else True)
    monkeypatch.setenv("SUMO_HOME", str(home))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert len(simulate(scene(tmp_path), 1.0, program="sumo").points) == 11


class Left:
    """Stands in for a connection that is left."""

    def close(self, *, wait: bool) -> None:
        assert not wait


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals")
@pytest.mark.parametrize(
    ("program", "ends_by"),
    [
        ("print(flush=True)", 0),
        ("print(flush=True); time.sleep(60)", -signal.SIGTERM),
        (
            "signal.signal(signal.SIGTERM, signal.SIG_IGN); print(flush=True); time.sleep(60)",
            -signal.SIGKILL,
        ),
    ],
    ids=["ends", "hangs", "hangs and hears nothing"],
)
def test_a_program_that_does_not_end_is_ended(
    program: str, ends_by: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked first, and made to only then."""
    monkeypatch.setattr(connection, "_TIME_TO_END", 0.3)
    command = [sys.executable, "-c", f"import signal, time; {program}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        over = connection.OverTraci(Left(), process, "here")
        over.close()
        over.close()
        assert process.returncode == ends_by
