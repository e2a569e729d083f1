"""Outputs that nobody looks at are not got: not by Python, and not by compiled code."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from adapters.fmi.block import Block
from adapters.fmi.fmi3 import Fmi3Instance
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.observer import SimulationResult
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from tests.adapters.fmu.conftest import LookAt

MS = 1_000_000
PATHS = pytest.mark.parametrize("compiled", [False, True])
ALGORITHMS = pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])


def mirrors(fmu: Callable[[str], Path], wires: dict[str, str], *, count: int = 2) -> System:
    """Copies of one FMU; `wires` lead from outputs of `c0` to inputs of `c1`."""
    mirror = FmuComponentType(fmu("mirror"))
    components: dict[str, Component] = {f"c{k}": mirror.create(f"c{k}", {}) for k in range(count)}
    return System(
        components,
        dict.fromkeys(components, MS),
        [Connection(Endpoint("c0", a), Endpoint("c1", b)) for a, b in wires.items()],
    )


def run(
    system: System,
    out: Path,
    include: tuple[str, ...],
    *,
    compiled: bool,
    algorithm: CosimulationAlgorithm | None = None,
    **settings: Any,
) -> SimulationResult:
    return simulate(
        system, algorithm or GaussSeidel(tuple(system.components)), start=0,
        stop=settings.pop("stop", 100 * MS), seed=1,
        observers=[Recorder(out, include=include)], compiled=compiled, **settings,
    )  # fmt: skip


@pytest.fixture
def got(monkeypatch: pytest.MonkeyPatch) -> dict[int, list[str]]:
    """What Python got of each instance, by address, variable by variable."""
    found: dict[int, list[str]] = {}
    read = Fmi3Instance._read_block

    def noted(self: Fmi3Instance, block: Block, elements: Any) -> None:
        found.setdefault(id(self), []).extend(v.name for v in block.variables)
        read(self, block, elements)

    monkeypatch.setattr(Fmi3Instance, "_read_block", noted)
    return found


def test_python_gets_what_is_connected_or_recorded(
    fmu: Callable[[str], Path], tmp_path: Path, got: dict[int, list[str]]
) -> None:
    """100 times and once at the start; what is neither, at the start and at the end."""
    run(mirrors(fmu, {"float64.out": "float64.in"}), tmp_path, ("c0.int32.out",), compiled=False)
    first, second = got.values()
    times = {name: first.count(name) for name in first}
    assert {name for name, count in times.items() if count == 102} == {"float64.out", "int32.out"}
    assert len(times) == 12
    assert sorted(set(times.values())) == [2, 102]
    assert {second.count(name) for name in times} == {2}


def test_compiled_code_gets_no_more(
    fmu: Callable[[str], Path], tmp_path: Path, look_at_plans: LookAt
) -> None:
    seen: list[list[int]] = []
    look_at_plans(
        lambda plan: seen.append(
            [sum(g.references for g in u.getting[: u.gettings]) for u in plan.unit[: plan.units]]
        )
    )
    run(mirrors(fmu, {"float64.out": "float64.in"}), tmp_path, ("c0.int32.out",), compiled=True)
    assert seen
    assert all(counts == [2, 0] for counts in seen)


@PATHS
@ALGORITHMS
def test_what_nobody_looks_at_is_read_at_the_end(
    fmu: Callable[[str], Path],
    tmp_path: Path,
    algorithm: CosimulationAlgorithm,
    compiled: bool,  # noqa: FBT001  (a parameter)
) -> None:
    wires = {"float64.out": "float64.in"}
    some = run(
        mirrors(fmu, wires), tmp_path / "some", ("c0.int32.out",), compiled=compiled,
        algorithm=algorithm,
    )  # fmt: skip
    whole = run(
        mirrors(fmu, wires), tmp_path / "all", ("*",), compiled=compiled, algorithm=algorithm
    )
    for name, values in whole.values.items():
        assert values.keys() == some.values[name].keys()
        for connector, value in values.items():
            np.testing.assert_array_equal(value, some.values[name][connector])
    one, all_ = (Recording(tmp_path / name)["c0.int32.out"] for name in ("some", "all"))
    np.testing.assert_array_equal(one.values, all_.values)


@PATHS
@ALGORITHMS
@pytest.mark.parametrize("is_recorded", [False, True])
def test_a_nan_that_nobody_looks_at_is_no_error(
    fmu: Callable[[str], Path],
    tmp_path: Path,
    algorithm: CosimulationAlgorithm,
    is_recorded: bool,  # noqa: FBT001  (a parameter)
    compiled: bool,  # noqa: FBT001  (a parameter)
) -> None:
    components: dict[str, Component] = {
        "broken": FmuComponentType(fmu("faulty")).create("broken", {"kind": 5}),
        "other": FmuComponentType(fmu("mirror")).create("other", {}),
    }
    system = System(components, dict.fromkeys(components, MS), [])
    include = ("*",) if is_recorded else ("other.*",)

    def result() -> SimulationResult:
        return run(system, tmp_path, include, compiled=compiled, algorithm=algorithm, stop=400 * MS)

    if is_recorded:
        with pytest.raises(ComponentError, match=r"`broken` at t = 0\.299 s: output `y` is nan"):
            result()
    else:
        found = result()
        assert found.time == 400 * MS
        assert np.isnan(found.values["broken"]["y"])


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


@PATHS
@ALGORITHMS
def test_a_step_under_way_hides_what_nobody_looked_at(
    fmu: Callable[[str], Path],
    lag2: Path,
    tmp_path: Path,
    algorithm: CosimulationAlgorithm,
    compiled: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """The run ends after some 36 ms; by Jacobi `slow` has stepped to 72 ms by then."""
    components: dict[str, Component] = {
        "slow": FmuComponentType(fmu("mirror")).create("slow", {}),
        "end": FmuComponentType(lag2).create("end", {}),
        "switch": Switch(),
    }
    sizes = {"slow": 72 * MS, "end": MS, "switch": 36 * MS}
    wire = Connection(Endpoint("switch", "on"), Endpoint("end", "flag_in"))
    found = run(
        System(components, sizes, [wire]), tmp_path, ("slow.int8.out",), compiled=compiled,
        algorithm=algorithm, stop=720 * MS, until=Endpoint("end", "flag_out"),
    )  # fmt: skip
    assert 36 * MS <= found.time < 38 * MS
    np.testing.assert_array_equal(found.values["slow"]["int8.out"], [1, 1, 1])
    assert ("float64.out" in found.values["slow"]) == isinstance(algorithm, GaussSeidel)
    assert found.values["end"].keys() == outputs_of(components["end"])


def outputs_of(component: Component) -> set[str]:
    """Names of the outputs of a component."""
    return {n for n, c in component.connectors.items() if c.causality is Causality.OUTPUT}


def test_solving_an_algebraic_loop_looks_at_all_outputs(
    fmu: Callable[[str], Path], tmp_path: Path, got: dict[int, list[str]]
) -> None:
    """How often a loop is swept does not depend on what is recorded."""
    system = mirrors(fmu, {"float64.out": "float64.in"})
    run(system, tmp_path, ("c0.int32.out",), compiled=True, algorithm=FixedPoint())
    assert all(each.count("int8.out") > 100 for each in got.values())
