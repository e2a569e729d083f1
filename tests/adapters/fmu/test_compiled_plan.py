"""Compiled code steps FMUs as Python does: the same bytes, the same errors."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings, strategies as st
from typing_extensions import override

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.plan.plan import RunPlan
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import Transformation
from tests.ran import check_equal, ran

MS = 1_000_000


class Source(Component):
    """A component of Python: numbers, truths and bytes that change at every other step."""

    connectors = {  # noqa: RUF012  (as components declare them)
        "number": Connector(causality=Causality.OUTPUT, unit="V"),
        "numbers": Connector(causality=Causality.OUTPUT, shape=(3,)),
        "truths": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.bool_),
        "bytes": Connector(
            causality=Causality.OUTPUT, dtype=None, mime_type="application/x-test; version=1"
        ),
        "seen": Connector(causality=Causality.OUTPUT),
        "look": Connector(causality=Causality.INPUT, unit="V"),
    }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._values = self._at(0, np.array(0.0))

    def _at(self, k: int, look: Any) -> dict[str, Any]:
        return {
            "number": np.array(float(k)),
            "numbers": np.array([k, -k, 0.5]),
            "truths": np.array([k % 2, k % 3, 1], bool),
            "bytes": bytes(range(k % 50)),
            "seen": np.array(look),
        }

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        k = t // h
        if k % 2:
            self._values = self._at(k, inputs["look"])

    @override
    def outputs(self) -> Signals:
        return self._values


@dataclass(frozen=True)
class Kinds:
    """FMUs to be coupled."""

    mirror: FmuComponentType
    lag: FmuComponentType
    lag2: FmuComponentType
    faulty: FmuComponentType


@pytest.fixture(scope="module")
def kinds(fmu: Callable[[str], Path], lag2: Path) -> Kinds:
    return Kinds(
        FmuComponentType(fmu("mirror")), FmuComponentType(fmu("lag")), FmuComponentType(lag2),
        FmuComponentType(fmu("faulty")),
    )  # fmt: skip


OUTPUTS = {
    "mirror": {
        kind: f"{kind}.out"
        for kind in ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32",
                     "int64", "uint64", "enumeration", "boolean")
    } | {"binary": "copy"},
    "lag": {"lags": "x"},
    "lag2": {"number": "x", "count": "count_out", "truth": "flag_out"},
    "source": {"number": "number", "float64": "numbers", "boolean": "truths", "binary": "bytes"},
}  # fmt: skip
INPUTS = {
    "mirror": {kind: f"{kind}.in" for kind in OUTPUTS["mirror"] if kind != "binary"}
    | {"binary": "payload"},
    "lag": {"lags": "u"},
    "lag2": {"number": "u", "count": "count_in", "truth": "flag_in"},
    "source": {"number": "look"},
}
STEPS = (1, 2, 3, 6)


@st.composite
def networks(draw: st.DrawFn) -> list[tuple[str, int, dict[str, int]]]:
    """Components: what they are, their step [ms], and for each input from whom it comes."""
    names = draw(
        st.lists(
            st.sampled_from(("mirror", "mirror", "lag", "lag2", "source")), min_size=1, max_size=5
        )
    )
    found = []
    for name in names:
        steps = (6, 18) if name == "source" else STEPS
        step = draw(st.sampled_from(steps))
        feeds = {}
        for kind in INPUTS[name]:
            offers = [k for k, other in enumerate(names) if kind in OUTPUTS[other]]
            is_driven = draw(st.integers(0, 3)) > 0
            if offers and is_driven:
                feeds[kind] = draw(st.sampled_from(offers))
        found.append((name, step, feeds))
    return found


def system_of(kinds: Kinds, network: list[tuple[str, int, dict[str, int]]]) -> System:
    components: dict[str, Component] = {}
    connections = []
    for k, (name, _, feeds) in enumerate(network):
        if name == "source":
            components[f"c{k}"] = Source()
        else:
            values = {"n_channel": 2} if name == "lag" else {}
            components[f"c{k}"] = getattr(kinds, name).create(f"c{k}", values)
        for kind, source in feeds.items():
            output = OUTPUTS[network[source][0]][kind]
            connections.append(
                Connection(Endpoint(f"c{source}", output), Endpoint(f"c{k}", INPUTS[name][kind]))
            )
    sizes = {f"c{k}": step * MS for k, (_, step, _) in enumerate(network)}
    return System(components, sizes, connections)


@pytest.mark.slow
@given(network=networks(), sequential=st.booleans())
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    max_examples=60,
    phases=[Phase.explicit, Phase.generate],
)
def test_any_network_gives_the_same_bytes(
    kinds: Kinds,
    tmp_path_factory: pytest.TempPathFactory,
    network: list[tuple[str, int, dict[str, int]]],
    sequential: bool,  # noqa: FBT001  (drawn)
) -> None:
    out = tmp_path_factory.mktemp("runs")
    order = tuple(f"c{k}" for k in range(len(network)))
    algorithm = GaussSeidel(order) if sequential else Jacobi()
    runs = [
        ran(system_of(kinds, network), algorithm, out / str(compiled), compiled=compiled)
        for compiled in (False, True)
    ]
    check_equal(*runs)
    assert not runs[0].error


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel(("c0", "c1", "c2"))])
def test_the_engine_takes_all_points_but_those_of_python(
    kinds: Kinds, tmp_path: Path, stretches: list[int], algorithm: CosimulationAlgorithm
) -> None:
    """Of 180 points a component of Python is due at 10; each of them ends a stretch."""
    network: list[tuple[str, int, dict[str, int]]] = [
        ("mirror", 1, {"float64": 2, "binary": 1}),
        ("mirror", 3, {"int32": 0, "binary": 2, "boolean": 0}),
        ("source", 18, {}),
    ]
    plain = ran(system_of(kinds, network), algorithm, tmp_path / "plain", compiled=False)
    assert not stretches
    compiled = ran(system_of(kinds, network), algorithm, tmp_path / "compiled", compiled=True)
    check_equal(plain, compiled)
    assert sum(stretches) == 180 - 10
    assert Recording(tmp_path / "compiled")["c0.float64.out"].times[-1] == 180 * MS


ALGORITHMS = [Jacobi(), GaussSeidel()]


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("start", [0, -1, 10**15, 10**16])
def test_steps_that_are_fractions_are_the_same(
    kinds: Kinds, tmp_path: Path, stretches: list[int], algorithm: CosimulationAlgorithm, start: int
) -> None:
    """1/60 s, 1/30 s and 1/700 s; a component of Python is due every 1/30 s; for a second."""
    network: list[tuple[str, int, dict[str, int]]] = [
        ("mirror", 1, {"float64": 2, "binary": 2}),
        ("lag", 1, {}),
        ("mirror", 1, {"int32": 0, "boolean": 0}),
        ("source", 1, {}),
    ]
    sizes = [Fraction(10**9, 60), Fraction(10**9, 30), Fraction(10**9, 700), Fraction(10**9, 30)]
    span: dict[str, Any] = {"start": start, "stop": start + 1000 * MS}
    runs = []
    for name in ("plain", "compiled"):
        made = system_of(kinds, network)
        system = System(
            made.components, dict(zip(made.components, sizes, strict=True)), made.connections
        )
        runs.append(ran(system, algorithm, tmp_path / name, compiled=name == "compiled", **span))
    check_equal(*runs)
    # 20 points of 1/60 s and of 1/700 s are the same; 30 are those of Python
    is_exact = start < 10**16  # behind that, 1/700 s of a run are no exact doubles
    assert sum(stretches) == (700 + 60 - 20 - 30 if is_exact else 0)
    times = Recording(tmp_path / "compiled")["c0.float64.out"].times
    assert list(times[:3] - start) == [0, 16_666_667, 33_333_333]


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("kind", [1, 2, 3, 4, 5])
def test_failures_say_the_same_and_leave_the_same_recording(
    kinds: Kinds, tmp_path: Path, kind: int, algorithm: CosimulationAlgorithm
) -> None:
    """A warning is none; discard, error, fatal and NaN end the run at 0.3 s."""

    def system() -> System:
        components: dict[str, Component] = {
            "first": kinds.mirror.create("first", {}),
            "broken": kinds.faulty.create("broken", {"kind": kind}),
            "last": kinds.mirror.create("last", {}),
        }
        wire = Connection(Endpoint("first", "int32.out"), Endpoint("last", "int32.in"))
        return System(components, dict.fromkeys(components, MS), [wire])

    runs = [
        ran(system(), algorithm, tmp_path / str(c), compiled=c, stop=400 * MS)
        for c in (False, True)
    ]
    check_equal(*runs)
    assert bool(runs[1].error) == (kind > 1)
    if kind > 1:
        assert runs[1].error.startswith("component `broken` at t = 0.299 s: ")
        times = Recording(tmp_path / "True")["broken.y"].times
        assert times[-1] == 299 * MS
        assert len(times) == 300


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_an_error_does_not_repeat_the_warnings_before_it(
    kinds: Kinds, tmp_path: Path, algorithm: CosimulationAlgorithm
) -> None:
    def system() -> System:
        broken = kinds.faulty.create("broken", {"kind": 3, "warns": True})
        return System({"broken": broken}, {"broken": MS}, [])

    runs = [
        ran(system(), algorithm, tmp_path / str(c), compiled=c, stop=400 * MS)
        for c in (False, True)
    ]
    check_equal(*runs)
    assert runs[1].error.startswith("component `broken` at t = 0.299 s: fmi3DoStep returned Error")
    assert "worse" not in runs[1].error


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("status", [1, 2, 3, 5])
def test_failures_of_fmi_2_say_the_same(
    kinds: Kinds, tmp_path: Path, status: int, algorithm: CosimulationAlgorithm
) -> None:
    def system() -> System:
        components = {
            "broken": kinds.lag2.create("broken", {"fail_at": 0.2505, "fail_as": status}),
            "other": kinds.lag2.create("other", {}),
        }
        wire = Connection(Endpoint("other", "x"), Endpoint("broken", "u"))
        return System(components, dict.fromkeys(components, MS), [wire])

    runs = [
        ran(system(), algorithm, tmp_path / str(c), compiled=c, stop=400 * MS)
        for c in (False, True)
    ]
    check_equal(*runs)
    assert bool(runs[1].error) == (status > 1)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("step", [1, 7])
def test_an_output_ends_the_run_at_the_same_point(
    kinds: Kinds, tmp_path: Path, stretches: list[int], algorithm: CosimulationAlgorithm, step: int
) -> None:
    """`flag_out` of FMI 2 follows its input, which a Python component sets at 36 ms."""

    def system() -> System:
        components: dict[str, Component] = {
            "clock": kinds.faulty.create("clock", {}),
            "lag": kinds.lag2.create("lag", {}),
            "switch": Switch(),
        }
        sizes = {"clock": MS, "lag": step * MS, "switch": 36 * MS}
        return System(
            components, sizes, [Connection(Endpoint("switch", "on"), Endpoint("lag", "flag_in"))]
        )

    runs = [
        ran(
            system(), algorithm, tmp_path / str(c), compiled=c, stop=252 * MS,
            until=Endpoint("lag", "flag_out"),
        )
        for c in (False, True)
    ]  # fmt: skip
    check_equal(*runs)
    assert stretches
    assert 36 * MS <= runs[1].time < 36 * MS + 2 * step * MS


class Switch(Component):
    """Is on from the end of its first step."""

    connectors = {"on": Connector(causality=Causality.OUTPUT, dtype=np.bool_)}  # noqa: RUF012

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._is_on = np.array(False)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._is_on = np.array(True)

    @override
    def outputs(self) -> Signals:
        return {"on": self._is_on}


def test_without_the_engine_python_does_it_all(
    kinds: Kinds, tmp_path: Path, stretches: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    network: list[tuple[str, int, dict[str, int]]] = [("mirror", 1, {"float64": 0})]
    with_it = ran(system_of(kinds, network), Jacobi(), tmp_path / "with", compiled=True)
    assert sum(stretches) == 180
    monkeypatch.setattr("orchestrator.plan.layouts.engine", lambda: None)
    without = ran(system_of(kinds, network), Jacobi(), tmp_path / "without", compiled=True)
    assert sum(stretches) == 180
    check_equal(with_it, without)


def test_what_reads_named_axes_of_somebody_outside_stays_in_python(
    kinds: Kinds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`c1` reads `c0`, which has to stay outside, and `c2` reads `c1`; `c3` reads nobody."""
    network: list[tuple[str, int, dict[str, int]]] = [
        ("lag", 1, {}),
        ("lag", 1, {"lags": 0}),
        ("lag", 1, {"lags": 1}),
        ("lag", 6, {}),
    ]
    plain = ran(system_of(kinds, network), Jacobi(), tmp_path / "plain", compiled=False)
    stepped: list[frozenset[str]] = []
    run = RunPlan.run

    def seen(self: RunPlan, *args: Any) -> Any:
        stepped.append(self.names)
        return run(self, *args)

    monkeypatch.setattr(RunPlan, "run", seen)
    monkeypatch.setattr("orchestrator.plan.plan._may_change", lambda _, name: name != "c0")
    outside = ran(system_of(kinds, network), Jacobi(), tmp_path / "outside", compiled=True)
    check_equal(plain, outside)
    assert not stepped  # nothing but `c3` is left, and Python is due in front of each of its points
    monkeypatch.undo()
    monkeypatch.setattr(RunPlan, "run", seen)
    whole = ran(system_of(kinds, network), Jacobi(), tmp_path / "whole", compiled=True)
    check_equal(plain, whole)
    assert set(stepped) == {frozenset({"c0", "c1", "c2", "c3"})}


@pytest.mark.parametrize("rates", [(1, 1), (1, 2), (3, 1)])
def test_inputs_of_one_type_come_each_from_its_own_source(
    kinds: Kinds, product2: Path, tmp_path: Path, rates: tuple[int, int]
) -> None:
    """y = a b at all times; a and b are set by one call, and a is new when b is not."""
    parts: dict[str, Component] = {
        "a": kinds.lag2.create("a", {"time_constant": 0.01}),
        "b": kinds.lag2.create("b", {"time_constant": 0.02}),
        "product": FmuComponentType(product2).create("product", {}),
    }
    steps = {"a": rates[0] * MS, "b": rates[1] * MS, "product": MS}
    plain = Transformation(converts=False)
    wires = [Connection(Endpoint(n, "x"), Endpoint("product", n), plain) for n in "ab"]
    simulate(
        System(parts, steps, wires), GaussSeidel(("a", "b", "product")),
        start=0, stop=12 * MS, seed=1, observers=[Recorder(tmp_path / "run")],
    )  # fmt: skip
    recording = Recording(tmp_path / "run")
    found = recording["product.y"]
    sources = [recording[f"{name}.x"] for name in "ab"]
    for t, y in zip(found.times[1:], found.values[1:], strict=True):
        a, b = (s.values[np.searchsorted(s.times, t, side="right") - 1] for s in sources)
        assert y == a * b
    assert len(set(found.values[1:].tolist())) == 12
