"""The oracle: what it decides between, what it counts, and that branching leaves no trace."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

import scenarios
from fmus.messages.records import NO_VEHICLE
from fmus.relay import Forced, Oracle
from fmus.relay.oracle import _Supply
from orchestrator.campaign.work import Work, perform
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError, CosimError
from orchestrator.recording import Recording
from orchestrator.testing import check_component
from tests.fmus.relay.world import LEFT, NEIGHBOURS, RIGHT, SHARER, STEP, inputs, started, switches

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
SETTINGS = ("seed=3", "time.stop=8.3 s", "components.traffic.parameters.background.spacing=60 m")
ORACLE = (
    "components.relay={type: relay-oracle, step: 100 ms, process: on-request, "
    "parameters: {window: 400 ms, maximum_range: 80 m}}"
)
WINDOW = 20 * STEP


def oracle(**parameters: Any) -> Oracle:
    component = Oracle(Oracle.Parameters(**parameters))
    started(component)
    return component


def step(
    component: Oracle,
    t: int = 0,
    count: int = 0,
    heard: Mapping[int, tuple[float, float, float]] = NEIGHBOURS,
) -> tuple[str, ...] | None:
    """The alternatives of the decision that the step opens."""
    values = inputs(heard) | {"received.sensor_data.count": np.array(count)}
    component.step(values, t, STEP)
    return None if component.decision is None else component.decision.alternatives


def relay_of(component: Oracle) -> int:
    return int(np.asarray(component.outputs()["relay"]))


def test_the_direct_link_comes_first_and_then_the_relay_with_the_shorter_longest_hop() -> None:
    assert step(oracle()) == ("direct", f"vehicle {LEFT}", f"vehicle {RIGHT}")


def test_no_more_alternatives_are_tried_than_wanted_the_first_ones() -> None:
    assert step(oracle(alternatives=2)) == ("direct", f"vehicle {LEFT}")
    assert step(oracle(alternatives=1)) == ("direct",)


@pytest.mark.parametrize("draws", [0, 4])
def test_its_decision_says_how_many_draws_it_wants(draws: int) -> None:
    component = oracle(draws=draws)
    step(component)
    assert component.decision is not None
    assert component.decision.draws == draws


def test_the_current_choice_comes_first_after_each_window_and_not_before() -> None:
    component = oracle()
    assert step(component) is not None
    component.decide(2)
    assert relay_of(component) == RIGHT
    for k in range(1, 20):
        assert step(component, t=k * STEP) is None
    assert step(component, t=WINDOW) == (f"vehicle {RIGHT}", "direct", f"vehicle {LEFT}")
    component.decide(1)
    assert (relay_of(component), switches(component)) == (NO_VEHICLE, 1)


def test_without_ever_a_bsm_of_the_sharer_there_is_the_direct_link_only() -> None:
    assert step(oracle(), heard={LEFT: NEIGHBOURS[LEFT]}) == ("direct",)
    assert SHARER in NEIGHBOURS


def test_the_horizon_is_a_window_and_what_a_choice_needs_to_take_effect() -> None:
    for component, expected in ((oracle(window=1.0), 1.2), (oracle(horizon=3.0), 3.0)):
        step(component, t=STEP)
        assert component.decision is not None
        assert component.decision.horizon == 2 * STEP + round(expected * 1e9)


def test_a_decision_must_be_taken() -> None:
    component = oracle()
    step(component)
    with pytest.raises(CosimError, match="its decision was never taken"):
        step(component, t=STEP)


def test_contract() -> None:
    values = inputs(NEIGHBOURS)
    check_component(oracle(), inputs=lambda t: values, steps=45)
    forced = Forced(Forced.Parameters(times=(0.2, 0.4), relays=(LEFT, RIGHT)))
    check_component(forced, inputs=lambda t: values, steps=6)


@given(st.lists(st.integers(0, 1), min_size=22, max_size=22), st.integers(0, 50))
def test_the_bound_is_never_below_what_comes(arrivals: list[int], before: int) -> None:
    """One packet in each step at most, as sent; the bound ends at what came."""
    supply = _Supply(10.0, 0, before)
    counts = before + np.cumsum(arrivals)
    assert supply.bound(22 * STEP) == before + 22
    for k, count in enumerate(counts, start=1):
        supply.update(int(count), k * STEP, STEP)
        assert counts[-1] <= supply.bound(22 * STEP) <= before + 22
    assert supply.bound(22 * STEP) <= counts[-1] + 1  # one may still be on its way


def test_a_perfect_alternative_cannot_be_beaten() -> None:
    """Its score is the bound of a decision just opened: all others are pruned at once."""
    component = oracle()
    step(component)
    bound = component.score_bound(23 * STEP)
    component.decide(0)
    for k in range(1, 23):
        step(component, t=k * STEP, count=k)
        if component.decision is not None:
            component.decide(0)
    assert component.score() == bound == 22


def test_more_packets_than_the_rate_allows_are_an_error_that_says_so() -> None:
    component = oracle()
    step(component)
    component.decide(0)
    with pytest.raises(CosimError, match=r"3 packets .* within 0\.1 s, .* `rate` \(10 Hz\)"):
        step(component, t=STEP, count=3)
    unlimited = oracle(rate=0.0)
    step(unlimited)
    unlimited.decide(0)
    step(unlimited, t=STEP, count=300)
    assert unlimited.score_bound(23 * STEP) == np.inf


def test_forced_relays_change_at_their_times_and_count_as_those_of_policies() -> None:
    forced = Forced(Forced.Parameters(times=(0.2, 0.4, 0.8), relays=(LEFT, RIGHT, LEFT)))
    started(forced)
    found = []
    for k in range(10):
        triggered = np.array(k not in {4, 5, 6})  # the change at 0.8 s is the first after a trigger
        forced.step(inputs(NEIGHBOURS) | {"match.trigger": triggered}, k * STEP, STEP)
        found.append((int(np.asarray(forced.outputs()["relay"])), switches(forced)))
    direct = (NO_VEHICLE, 0)
    assert found == [direct, *[(LEFT, 1)] * 2, *[(RIGHT, 2)] * 4, *[(LEFT, 2)] * 3]


@pytest.mark.parametrize(
    ("times", "relays", "message"),
    [
        ((1.0,), (), "`relays` has 0 entries and `times` 1; give one time for each relay"),
        ((1.0, 1.0), (2, 3), "`times` must ascend"),
        ((2.0, 1.0), (2, 3), "`times` must ascend"),
    ],
)
def test_choices_that_make_no_sense_are_refused(
    times: tuple[float, ...], relays: tuple[int, ...], message: str
) -> None:
    with pytest.raises(ComponentTypeError, match=message):
        Forced(Forced.Parameters(times=times, relays=relays))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")
def test_an_oracle_among_several_processes_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    oracle_type = "components.relay.type=relay-oracle"
    command = ["run", str(SCENARIO), "--set", oracle_type, "--transport", "loopback", "--json"]
    assert main([*command, "--quiet"]) == 2
    (problem,) = json.loads(capsys.readouterr().out)["error"]["problems"]
    assert problem["message"].startswith(
        "component `relay` tries its alternatives in copies of this process, but `traffic`, "
        "`lidar`, `perception`, `relay` step outside of it and would not be copied"
    )
    assert problem["line"] > 1


FAIR = ORACLE.replace("maximum_range: 80 m", "maximum_range: 80 m, draws: 2, alternatives: 8")


def run(out: Path, relay: str, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    settings = [part for each in (*SETTINGS, relay) for part in ("--set", each)]
    command = ["run", str(SCENARIO), *settings, "--out", str(out), "--no-figure"]
    assert main([*command, "--json", "--quiet"]) == 0
    return str(json.loads(capsys.readouterr().out)["fingerprint"])


def choices(recording: Recording) -> list[tuple[float, int]]:
    """The changes of the relay: times [s] and vehicles."""
    series = recording["relay.relay"]
    relays = [int(np.asarray(series[k])) for k in range(len(series))]
    changes = [k for k in range(1, len(relays)) if relays[k] != relays[k - 1]]
    return [(series.times[k] / 1e9, relays[k]) for k in changes]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")
@pytest.mark.parametrize("unit", [ORACLE, FAIR], ids=["knowing", "fair"])
def test_branching_leaves_no_trace(
    unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The oracle's run, the same choices given, and a worker's run: the same bytes."""
    oracles = run(tmp_path / "oracle", unit, capsys)
    made = choices(Recording(tmp_path / "oracle"))
    log = (tmp_path / "oracle" / "log.txt").read_text()
    assert log.count("decided at") >= 2
    assert len(made) >= 2
    times = ", ".join(f"{time:g} s" for time, _ in made)
    relays = ", ".join(str(relay) for _, relay in made)
    given = f"parameters: {{times: [{times}], relays: [{relays}]}}"
    forced = f"components.relay={{type: relay-forced, step: 100 ms, {given}}}"
    assert run(tmp_path / "forced", forced, capsys) == oracles
    work = Work(
        scenario=str(SCENARIO), overrides=(*SETTINGS, unit), keep=None, scratch=str(tmp_path)
    )
    result = perform(work)
    assert (result.error, result.fingerprint) == (None, oracles)


def alive(note: str) -> list[int]:
    """The processes with `note` in their environment; zombies that nobody collects do not count."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            environment = (process / "environ").read_bytes()
            zombie = "\nState:\tZ" in (process / "status").read_text()
        except OSError:
            continue
        if note.encode() in environment and not zombie:
            found.append(int(process.name))
    return found


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_run_ends_with_the_worker_that_asked_for_it(tmp_path: Path) -> None:
    """Whoever kills a worker finds nothing of it later: not the run, not its files."""
    arguments = {"scenario": str(SCENARIO), "overrides": (ORACLE,), "scratch": str(tmp_path)}
    code = "from orchestrator.campaign.work import Work, perform; perform(Work(keep=None, **{}))"
    note = f"NLOSIM_TEST={tmp_path}"
    worker = subprocess.Popen(
        [sys.executable, "-c", code.format(arguments)],
        env={**os.environ, "NLOSIM_TEST": str(tmp_path)},
        stderr=subprocess.DEVNULL,
    )
    while not list(tmp_path.glob("run-*/signals")):
        assert worker.poll() is None
        time.sleep(0.05)
    assert len(alive(note)) >= 2
    worker.kill()
    worker.wait()
    deadline = time.monotonic() + 30
    while alive(note):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert list(tmp_path.iterdir()) == []
