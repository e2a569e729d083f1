"""`until`: a run ends at the first communication point at which an output is true."""

import io
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli import main
from orchestrator.component import Component, ConcurrentComponent
from orchestrator.errors import ComponentError, ScenarioError, SystemStructureError
from orchestrator.observer import SimulationResult, progress_meter
from orchestrator.recording.reader import Recording
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.wiring import assemble
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from tests.orchestrator.summing import InOnePiece, Trace, in_two_pieces

OVER = Endpoint("a", "over")
ALGORITHMS = [Jacobi(), GaussSeidel(("a", "b")), GaussSeidel(("b", "a"))]


class Counter(ConcurrentComponent):
    """Adds what it reads to a sum, modulo 61; `over` while that is at least `goal`.

    `log` has its calls. It can be asked to step in one piece or in two.
    """

    connectors: ClassVar[Mapping[str, Connector]] = {
        "u": Connector(causality=Causality.INPUT, dtype=np.int64),
        "sum": Connector(causality=Causality.OUTPUT, dtype=np.int64),
        "over": Connector(causality=Causality.OUTPUT, dtype=np.bool_),
    }

    def __init__(self, goal: int = 10**9, fails_at: Time | None = None) -> None:
        self.log: list[str] = []
        self._goal, self._fails_at = goal, fails_at

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._sum = 0

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._next = (self._sum + int(np.asarray(inputs["u"]))) % 61 + 1
        self._t = t
        self.log.append(f"begin {t}")

    @override
    def finish_step(self) -> None:
        if self._t == self._fails_at:
            raise RuntimeError("out of numbers")
        self._sum = self._next
        self.log.append(f"finish {self._t}")

    @override
    def outputs(self) -> Signals:
        return {"sum": np.array(self._sum), "over": np.array(self._sum >= self._goal)}


def run(
    algorithm: CosimulationAlgorithm,
    steps: Mapping[str, Duration],
    *,
    goal: int,
    until: Endpoint | None,
    place: Callable[[Counter], Component] = InOnePiece,
    fails_at: Time | None = None,
) -> tuple[SimulationResult, Trace, dict[str, Counter]]:
    """Two counters that read each other, for 60 ns; `a` ends the run, `b` may fail."""
    counters = {"a": Counter(goal), "b": Counter(fails_at=fails_at)}
    system = System(
        {name: place(counter) for name, counter in counters.items()},
        steps,
        [Connection(Endpoint(s, "sum"), Endpoint(t, "u")) for s, t in ("ab", "ba")],
    )
    trace = Trace()
    result = simulate(system, algorithm, start=0, stop=60, seed=0, observers=[trace], until=until)
    return result, trace, counters


PLACES = st.sampled_from([InOnePiece, in_two_pieces])
STEPS = st.sampled_from([1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60])


@given(st.sampled_from(ALGORITHMS), STEPS, STEPS, st.integers(0, 60), PLACES)
def test_the_run_is_the_beginning_of_the_run_without_it(
    algorithm: CosimulationAlgorithm,
    a: int,
    b: int,
    goal: int,
    place: Callable[[Counter], Component],
) -> None:
    """Up to and with the first communication point at which the published value is true."""
    steps = {"a": a, "b": b}
    _, whole, _ = run(algorithm, steps, goal=goal, until=None, place=place)
    result, trace, counters = run(algorithm, steps, goal=goal, until=OVER, place=place)
    last = next((k for k, seen in enumerate(whole.seen) if seen[2]["a"] >= goal), None)
    assert trace.seen == whole.seen[: None if last is None else last + 1]
    assert result.status == "done"
    assert result.time == trace.seen[-1][0]
    begun = [line.split()[1] for c in counters.values() for line in c.log if "begin" in line]
    ended = [line.split()[1] for c in counters.values() for line in c.log if "finish" in line]
    assert begun == ended  # nobody is left in the middle of a step


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_an_output_that_is_true_at_the_start_ends_the_run_there(
    algorithm: CosimulationAlgorithm,
) -> None:
    result, trace, counters = run(algorithm, {"a": 5, "b": 5}, goal=0, until=OVER)
    assert [t for t, _, _ in trace.seen] == [0]
    assert (result.time, result.speed) == (0, 0.0)
    assert counters["a"].log == counters["b"].log == []


@pytest.mark.parametrize("place", [InOnePiece, in_two_pieces])
def test_a_step_that_was_begun_and_fails_beyond_the_end_fails_wherever_it_runs(
    place: Callable[[Counter], Component],
) -> None:
    """Jacobi: `b` steps from 0 to 60 while `a` comes to the end of the run at 10."""
    with pytest.raises(ComponentError, match="component `b` at t = 0 s: RuntimeError: out of num"):
        run(Jacobi(), {"a": 10, "b": 60}, goal=1, until=OVER, place=place, fails_at=0)


@pytest.mark.parametrize("fails_at", [0, None])
@pytest.mark.parametrize("place", [InOnePiece, in_two_pieces])
def test_a_step_that_gauss_seidel_need_not_take_fails_nowhere(
    place: Callable[[Counter], Component], fails_at: Time | None
) -> None:
    """`b` reads nobody, so elsewhere it has begun its step from 0 to 60; the run ends at 10."""
    counters = {"a": Counter(1), "b": Counter(fails_at=fails_at)}
    system = System(
        {name: place(counter) for name, counter in counters.items()},
        {"a": 10, "b": 60},
        [Connection(Endpoint("b", "sum"), Endpoint("a", "u"))],
    )
    result = simulate(system, GaussSeidel(), start=0, stop=60, seed=0, until=OVER)
    assert (result.status, result.time) == ("done", 10)
    assert int(np.asarray(result.values["b"]["sum"])) == 0


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ("c.over", "cannot run until `c.over`: there is no component `c`; there are: a, b"),
        ("a.ovre", "`a` has no connector `ovre`; did you mean `over`?"),
        ("a.sum", "it is an output of type int64[], and must be an output of type bool[]; write"),
        ("a.sum", "write one of `a.over`"),
        ("a.u", "it is an input of type int64[], and must be an output"),
    ],
)
def test_what_is_no_boolean_output_is_refused_before_the_run(until: str, message: str) -> None:
    with pytest.raises(SystemStructureError) as error:
        run(Jacobi(), {"a": 5, "b": 5}, goal=1, until=Endpoint.parse(until))
    assert message in str(error.value)


# ---- in scenarios

ALARM = (
    "components.alarm={type: alarm, step: 20 ms, process: on-request, parameters: {after: 0.43}}"
)
UNTIL = "time.until=alarm.bell.rings"


def nlosim(
    capsys: pytest.CaptureFixture[str], scenario: Path, out: Path, *settings: str, **options: str
) -> Any:
    """The JSON object of a run that must succeed."""
    arguments = ["run", str(scenario), "--out", str(out), "--json", "--quiet"]
    for setting in settings:
        arguments += ["--set", setting]
    for option, value in options.items():
        arguments += [f"--{option}", value]
    code = main(arguments)
    captured = capsys.readouterr()
    assert code == 0, captured
    return json.loads(captured.out)


def test_the_manifest_says_when_a_run_ended_and_rates_are_those_of_that_time(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = nlosim(capsys, scenario_file, tmp_path / "out", ALARM, UNTIL)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert (manifest["stop_ns"], manifest["reached_ns"]) == (10**9, 440_000_000)
    assert manifest["status"] == "done"
    assert manifest["scenario"]["time"] == {
        "start": "0 s",
        "stop": "1 s",
        "until": "alarm.bell.rings",
    }
    assert found["simulated_s"] == 0.44
    assert found["sim_seconds_per_wall_second"] == pytest.approx(0.44 / found["wall_s"])
    recording = Recording(tmp_path / "out")
    assert [int(recording[f"{name}"].times[-1]) for name in ("car.power", "base.y")] == [
        400_000_000,
        400_000_000,
    ]
    assert np.asarray(recording["alarm.bell.rings"].values).tolist() == [False] * 22 + [True]
    log = (tmp_path / "out" / "log.txt").read_text()
    assert "`alarm.bell.rings` is true at t = 0.44 s" in log


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_the_fingerprint_does_not_depend_on_where_components_run(
    algorithm: str, scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = (ALARM, UNTIL, f"coupling.algorithm={algorithm}")
    runs = [
        nlosim(capsys, scenario_file, tmp_path / transport, *settings, transport=transport)
        for transport in ("in-process", "loopback")
    ]
    assert runs[0]["fingerprint"] == runs[1]["fingerprint"]
    assert runs[0]["simulated_s"] == runs[1]["simulated_s"] == 0.44


def test_the_scenario_in_the_manifest_ends_as_early(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = nlosim(capsys, scenario_file, tmp_path / "first", ALARM, UNTIL)
    manifest = json.loads((tmp_path / "first" / "manifest.json").read_text())
    again = tmp_path / "again.yaml"
    again.write_text(json.dumps(manifest["scenario"]))
    second = nlosim(capsys, again, tmp_path / "second")
    assert second["fingerprint"] == first["fingerprint"]
    assert "until" not in load_scenario(scenario_file).resolved()["time"]


@pytest.mark.parametrize(
    ("text", "overrides", "until"),
    [
        ("", (), "alarm.bell.rings"),
        ("time: {until: car.far}", (), "car.far"),
        ("time: {until: null}", (), None),
        ("time: {until:}", (), None),
        ("time: {stop: 2 s}", (), "alarm.bell.rings"),
        ("", ("time.until=car.far",), "car.far"),
        ("", ("time.until=null",), None),
        ("time: {until: null}", (UNTIL,), "alarm.bell.rings"),
    ],
)
def test_a_child_and_an_override_can_set_it_and_remove_it(
    scenario_file: Path, text: str, overrides: Sequence[str], until: str | None
) -> None:
    base = scenario_file.read_text().replace("stop: 1 s", "stop: 1 s, until: alarm.bell.rings")
    base = base.replace("components:", "components:\n  alarm: {type: alarm, step: 20 ms}")
    scenario_file.write_text(base)
    child = scenario_file.with_name("child.yaml")
    child.write_text(f"schema: 1\nextends: two.yaml\n{text}\n")
    scenario = load_scenario(child, overrides)
    assert scenario.until == (None if until is None else Endpoint.parse(until))


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ("alarm.bell.ring", "`alarm` has no connector `bell.ring`; did you mean `bell.rings`?"),
        ("alarm.lamps", "it is an output of type bool[2], and must be an output of type bool[]"),
        ("base.u", "an input of type float64[], and must be an output of type bool[]; `base` has"),
    ],
)
def test_a_wrong_output_is_a_problem_of_its_place_beside_all_others(
    scenario_file: Path, until: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A connector that does not exist and one of another unit, too."""
    text = scenario_file.read_text().replace("stop: 1 s", f"stop: 1 s, until: {until}")
    scenario_file.write_text(text.replace("car.vehicle,", "car.power,").replace("vehicle}", "u}"))
    for setting, other in (
        ("seed=1", "cannot connect `car.power` to `base.u`: units differ"),
        ("connections.0.from=car.vehicel", "`car` has no connector `vehicel`"),
    ):
        scenario = load_scenario(scenario_file, [ALARM, setting])
        with pytest.raises(ScenarioError) as error:
            assemble(scenario)
        first, second = map(str, error.value.problems)
        assert first.startswith(f"{scenario_file}:3:38: time.until: ")
        assert message in first
        assert other in second
        assert main(["check", str(scenario_file), "--set", ALARM, "--set", setting]) == 2
        assert first in capsys.readouterr().out


def test_an_override_is_located_in_the_command_line(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file, [ALARM, "time.until=alarm.lamps"])
    with pytest.raises(ScenarioError, match=r"--set time.until=alarm.lamps:1:12: time.until: it"):
        assemble(scenario)
    with pytest.raises(ScenarioError, match=r"1:12: time\.until: there is no component `alrm`"):
        load_scenario(scenario_file, [ALARM, "time.until=alrm.lamps"])


def test_the_graph_says_until_when(scenario_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph", str(scenario_file), "--set", ALARM, "--set", UNTIL]) == 0
    assert "0 s to 1 s or until `alarm.bell.rings`" in capsys.readouterr().out
    assert main(["graph", str(scenario_file), "--set", ALARM, "--set", UNTIL, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["until"] == "alarm.bell.rings"


def test_the_progress_of_a_run_that_ended_early_is_complete() -> None:
    stream = io.StringIO()
    counter = Counter(goal=2)
    system = System({"a": counter}, {"a": 10**8}, [])
    meter = progress_meter(always=True, stream=stream)
    simulate(system, GaussSeidel(), start=0, stop=10**9, seed=0, observers=[meter], until=OVER)
    last = stream.getvalue().rstrip().rsplit("\r", 1)[1]
    assert "0.20/0.20 s" in last
    assert "100%" in last
