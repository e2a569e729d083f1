"""Inputs that are made of outputs are the same to the last bit, whoever makes them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings, strategies as st
from typing_extensions import override

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.elements import Elements, Span
from orchestrator.errors import ComponentError
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import Transformation, is_widening

MS = 1_000_000
KINDS = {
    kind: np.dtype(kind)
    for kind in ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32",
                 "int64", "uint64")
} | {"boolean": np.dtype(bool)}  # fmt: skip
STEPS = (1, 2, 3, 6)
ELEMENTS = (
    Elements((0,)), Elements((-1,)), Elements((Span(0, 2),)), Elements((Span(None, None, -1),)),
    Elements((Span(0, 3, 2),)), Elements((1,)), Elements(),
)  # fmt: skip
NUMBERS = (1.0, -0.3, 2.5, 1 / 3, 0.0)


class Source(Component):
    """A component of Python: numbers and truths that change at every other step."""

    connectors = {  # noqa: RUF012  (as components declare them)
        "float64.out": Connector(causality=Causality.OUTPUT, shape=(3,)),
        "float32.out": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.float32),
        "int16.out": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.int16),
        "uint32.out": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.uint32),
        "uint64.out": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.uint64),
        "boolean.out": Connector(causality=Causality.OUTPUT, shape=(3,), dtype=np.bool_),
        "float64.in": Connector(causality=Causality.INPUT, shape=(3,)),
        "seen": Connector(causality=Causality.OUTPUT, shape=(3,)),
    }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._values = self._at(0, np.zeros(3))

    def _at(self, k: int, look: Any) -> dict[str, Any]:
        return {
            "float64.out": np.array([k, -k / 3, 0.5]),
            "float32.out": np.array([0.1 * k, k, -2.5], np.float32),
            "int16.out": np.array([k, -k, 30000], np.int16),
            "uint32.out": np.array([k, 2**31 + k, 2**32 - 1 - k], np.uint32),
            "uint64.out": np.array([k, 2**63 + k, 2**64 - 1 - k], np.uint64),
            "boolean.out": np.array([k % 2, k % 3, 1], bool),
            "seen": np.array(look),
        }

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if t // h % 2:
            self._values = self._at(t // h, inputs["float64.in"])

    @override
    def outputs(self) -> Signals:
        return self._values


SCALARS = {"float32", "int64"}
"""Of the mirror; all else has three elements."""

SHAPES: dict[str, dict[str, tuple[int, ...]]] = {
    "mirror": {kind: () if kind in SCALARS else (3,) for kind in KINDS},
    "source": {n.removesuffix(".out"): (3,) for n in Source.connectors if n.endswith(".out")},
}
INPUTS = {"mirror": list(KINDS), "source": ["float64"]}


@dataclass
class Network:
    """Components with their steps [ms], and how they are connected."""

    parts: list[tuple[str, int]]
    wires: list[Connection] = field(default_factory=list)


def offers(
    parts: list[tuple[str, int]], kind: str, shape: tuple[int | str, ...]
) -> list[tuple[Endpoint, Elements]]:
    """What may drive elements of one type that have this shape."""
    return [
        (Endpoint(f"c{k}", f"{other}.out"), picked)
        for k, (name, _) in enumerate(parts)
        for other, length in SHAPES[name].items()
        if is_widening(KINDS[other], KINDS[kind])
        for picked in ELEMENTS
        if (picked.are_all or length) and picked.of(length) == shape
    ]


@st.composite
def wires(draw: st.DrawFn, parts: list[tuple[str, int]], k: int, kind: str) -> list[Connection]:
    """Connections to one input: to several of its elements, and added to those before."""
    name, step = parts[k]
    shape = SHAPES[name][kind]
    is_real = KINDS[kind].kind == "f"
    found: list[Connection] = []
    taken: set[int] = set()
    for placed in draw(st.permutations(ELEMENTS if shape else ELEMENTS[-1:])):
        places = set(placed.places(shape).ravel().tolist())
        terms = draw(st.integers(0, 3 if is_real else 1))
        if taken & places or not terms:
            continue
        taken |= places
        for n in range(terms):
            output, picked = draw(st.sampled_from(offers(parts, kind, placed.of(shape))))
            late = draw(st.booleans())
            way = Transformation(
                picked=picked,
                placed=placed,
                gain=draw(st.sampled_from(NUMBERS)) if is_real else 1.0,
                offset=draw(st.sampled_from(NUMBERS)) if is_real else 0.0,
                delay=draw(st.sampled_from((0, MS // 2, 3 * MS, 20 * MS))) if late else 0,
                sample=draw(st.sampled_from((0, 0, step * MS, 3 * step * MS))) if late else 0,
                adds=n > 0,
            )
            found.append(Connection(output, Endpoint(f"c{k}", f"{kind}.in"), way))
    return found


@st.composite
def networks(draw: st.DrawFn) -> Network:
    """Copies of one FMU and components of Python, coupled in all ways that there are."""
    names = ["mirror", *draw(st.lists(st.sampled_from(("mirror", "source")), max_size=3))]
    steps = {"mirror": STEPS, "source": (6, 18)}
    found = Network([(name, draw(st.sampled_from(steps[name]))) for name in names])
    for k, (name, _) in enumerate(found.parts):
        for kind in draw(st.lists(st.sampled_from(INPUTS[name]), max_size=4, unique=True)):
            found.wires += draw(wires(found.parts, k, kind))
    assume(found.wires)
    return found


def system_of(mirror: FmuComponentType, network: Network) -> System:
    components: dict[str, Component] = {
        f"c{k}": mirror.create(f"c{k}", {}) if name == "mirror" else Source()
        for k, (name, _) in enumerate(network.parts)
    }
    sizes = {f"c{k}": step * MS for k, (_, step) in enumerate(network.parts)}
    return System(components, sizes, network.wires)


def ran(
    system: System, algorithm: CosimulationAlgorithm, out: Path, *, compiled: bool, stop: int = 180
) -> tuple[str, str]:
    """The fingerprint, and the error."""
    recorder = Recorder(out)
    try:
        simulate(
            system, algorithm, start=0, stop=stop * MS, seed=3, observers=[recorder],
            compiled=compiled,
        )  # fmt: skip
    except ComponentError as error:
        return recorder.fingerprint, str(error)
    return recorder.fingerprint, ""


@pytest.fixture(scope="module")
def mirror(fmu: Callable[[str], Path]) -> FmuComponentType:
    return FmuComponentType(fmu("mirror"))


@given(network=networks(), sequential=st.booleans())
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    max_examples=40,
    phases=[Phase.explicit, Phase.generate],
    deadline=None,
)
def test_any_network_gives_the_same_bytes(
    mirror: FmuComponentType,
    tmp_path_factory: pytest.TempPathFactory,
    network: Network,
    sequential: bool,  # noqa: FBT001  (drawn)
) -> None:
    out = tmp_path_factory.mktemp("runs")
    order = tuple(f"c{k}" for k in range(len(network.parts)))
    algorithm = GaussSeidel(order) if sequential else Jacobi()
    plain, compiled = (
        ran(system_of(mirror, network), algorithm, out / str(c), compiled=c) for c in (False, True)
    )
    assert plain == compiled


def pair(mirror: FmuComponentType, *ways: tuple[str, str, Transformation]) -> System:
    """Two copies; from outputs of the first to inputs of the second."""
    components: dict[str, Component] = {name: mirror.create(name, {}) for name in ("a", "b")}
    wires = [Connection(Endpoint("a", o), Endpoint("b", i), way) for o, i, way in ways]
    return System(components, {"a": MS, "b": 2 * MS}, wires)


FIRST = Elements((0,))
WAYS = {
    "element": Transformation(picked=Elements((2,)), placed=FIRST),
    "slice": Transformation(picked=Elements((Span(0, 2),)), placed=Elements((Span(1, 3),))),
    "gain": Transformation(gain=-0.3),
    "offset": Transformation(offset=1 / 3),
    "delay": Transformation(delay=20 * MS),
    "sample": Transformation(sample=8 * MS),
    "sampled late": Transformation(delay=5 * MS, sample=8 * MS),
}
ALGORITHMS = pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel(("a", "b"))])


@ALGORITHMS
@pytest.mark.parametrize("name", WAYS)
def test_the_engine_takes_all_points(
    mirror: FmuComponentType,
    tmp_path: Path,
    stretches: list[int],
    name: str,
    algorithm: CosimulationAlgorithm,
) -> None:
    """Also those of what widens, and of what is added; and it does what the way says."""
    ways = (
        ("float64.out", "float64.in", WAYS[name]),
        ("int16.out", "int32.in", Transformation()),
        ("float32.out", "float32.in", Transformation(gain=0.5)),
        ("float32.out", "float32.in", Transformation(adds=True)),
    )
    system = pair(mirror, *ways)
    plain, compiled = (ran(system, algorithm, tmp_path / str(c), compiled=c) for c in (False, True))
    assert plain == compiled
    assert not plain[1]
    assert sum(stretches) == 180


@ALGORITHMS
def test_what_overflows_is_the_same_error(
    mirror: FmuComponentType, tmp_path: Path, stretches: list[int], algorithm: CosimulationAlgorithm
) -> None:
    """`a` gives 0.5 + t: twice 3.2e38 of it becomes more than a float32 holds at 32 ms."""
    way, more = Transformation(gain=3.2e38), Transformation(gain=3.2e38, adds=True)
    errors = []
    for ways in ((way,), (way, more)):
        wires = [("float32.out", "float32.in", each) for each in ways]
        found = {
            ran(pair(mirror, *wires), algorithm, tmp_path / f"{len(ways)}{c}", compiled=c)
            for c in (False, True)
        }
        assert len(found) == 1
        errors.append(found.pop()[1])
    begin = 0.032 if isinstance(algorithm, Jacobi) else 0.03
    what = "what its connections make of input `float32.in` is not finite"
    assert errors == ["", f"component `b` at t = {begin} s: {what}"]
    before = 32 if isinstance(algorithm, Jacobi) else 31
    assert sum(stretches) == 180 + before


def test_large_whole_numbers_widen(
    mirror: FmuComponentType, tmp_path: Path, stretches: list[int]
) -> None:
    """From 2^31 on a uint32 is no negative int32."""
    second, turned = Elements((1,)), Elements((Span(None, None, -1),))
    wires = [
        ("uint32", "int64", Transformation(picked=second)),
        ("uint32", "uint64", Transformation()),
        ("uint32", "float64", Transformation(picked=turned)),
        ("int16", "int32", Transformation()),
        ("boolean", "boolean", Transformation(picked=turned)),
    ]
    network = Network(
        [("mirror", 1), ("source", 6)],
        [Connection(Endpoint("c1", f"{a}.out"), Endpoint("c0", f"{b}.in"), w) for a, b, w in wires],
    )
    plain, compiled = (
        ran(system_of(mirror, network), Jacobi(), tmp_path / str(c), compiled=c)
        for c in (False, True)
    )
    assert plain == compiled
    assert sum(stretches) == 180 - 30
    last = Recording(tmp_path / "True")["c0.int64.out"].at(180 * MS)
    assert last == 2**31 + 27 + 180


class Percent(Component):
    """Ramps that are given in another unit."""

    connectors = {"x": Connector(causality=Causality.OUTPUT, unit="%", shape=(3,))}  # noqa: RUF012

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = np.array([1e3, 2e3, 7e3])

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._x = self._x + np.array([1e3, 7e3, 1e4]) / 3

    @override
    def outputs(self) -> Signals:
        return {"x": self._x}


def test_a_unit_is_converted_by_the_same_roundings(
    mirror: FmuComponentType, tmp_path: Path, stretches: list[int]
) -> None:
    """`/ 100` is not `* 0.01`: of 90 values some differ in the last bit."""
    components: dict[str, Component] = {"m": mirror.create("m", {}), "x": Percent()}
    wire = Connection(Endpoint("x", "x"), Endpoint("m", "float64.in"))
    system = System(components, {"m": MS, "x": 6 * MS}, [wire])
    plain, compiled = (ran(system, Jacobi(), tmp_path / str(c), compiled=c) for c in (False, True))
    assert plain == compiled
    assert not plain[1]
    assert sum(stretches) == 180 - 30
    x = np.asarray(Recording(tmp_path / "True")["x.x"].values)
    assert np.any(x / 100.0 != x * 0.01)


def test_values_of_python_pass_through_it_late(
    mirror: FmuComponentType, tmp_path: Path, stretches: list[int]
) -> None:
    """`c1` is of Python, with 18 ms; what it publishes arrives 20 ms later, 10 points in 11."""
    network = Network(
        [("mirror", 1), ("source", 18)],
        [
            Connection(
                Endpoint("c1", "float64.out"), Endpoint("c0", "float64.in"),
                Transformation(delay=20 * MS, gain=2.0),
            )
        ],
    )  # fmt: skip
    plain, compiled = (
        ran(system_of(mirror, network), Jacobi(), tmp_path / str(c), compiled=c)
        for c in (False, True)
    )
    assert plain == compiled
    assert sum(stretches) == 180 - 10
    recording = Recording(tmp_path / "True")
    got = recording["c0.float64.out"]
    said = recording["c1.float64.out"]
    for end, values in zip(got.times[1:], got.values[1:], strict=True):
        begin = end - MS
        late = np.searchsorted(said.times, begin - 20 * MS, side="right") - 1
        read = np.ones(3) if late < 0 else 2.0 * said.values[late]
        np.testing.assert_array_equal(values, read / 2 + (begin / 1e9 + 0.001))
