"""FMUs go on where compiled code stopped, and the other way round: nothing is set too late."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.plan import plan
from orchestrator.plan.unit import UnitPlan
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time

MS = 1_000_000
NUMBERS = (np.array([1.0, 2.0, 3.0]), np.array([-1.0, -2.0, -3.0]))
BYTES = (b"one", b"")


class Alternating(Component):
    """Publishes two objects in turn: the first at even steps, the second at odd ones."""

    connectors = {  # noqa: RUF012  (as components declare them)
        "numbers": Connector(causality=Causality.OUTPUT, shape=(3,)),
        "bytes": Connector(
            causality=Causality.OUTPUT, dtype=None, mime_type="application/x-test; version=1"
        ),
    }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._k = 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._k = (t // h + 1) % 2

    @override
    def outputs(self) -> Signals:
        return {"numbers": NUMBERS[self._k], "bytes": BYTES[self._k]}


ORDERS = [("slow", "fast", "source"), ("source", "slow", "fast"), ("fast", "source", "slow")]


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("slow", [8, 16])
@pytest.mark.parametrize("algorithm", [Jacobi(), *map(GaussSeidel, ORDERS)])
def test_an_object_that_comes_back_is_set_again(
    fmu: Callable[[str], Path],
    tmp_path: Path,
    algorithm: CosimulationAlgorithm,
    slow: int,
    compiled: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """`source` steps every 6 ms; where `slow` is due, too, Python steps `fast`, else compiled code.

    Python had set the object that `fast` reads there, too; compiled code had set the other since.
    """
    mirror = FmuComponentType(fmu("mirror"))
    components: dict[str, Component] = {
        "slow": mirror.create("slow", {}),
        "fast": mirror.create("fast", {}),
        "source": Alternating(),
    }
    wires = [
        Connection(Endpoint("source", output), Endpoint(name, connector))
        for name in ("slow", "fast")
        for output, connector in (("numbers", "float64.in"), ("bytes", "payload"))
    ]
    sizes = {"slow": slow * MS, "fast": MS, "source": 6 * MS}
    simulate(
        System(components, sizes, wires), algorithm, start=0, stop=288 * MS, seed=1,
        observers=[Recorder(tmp_path / "run")], compiled=compiled,
    )  # fmt: skip
    recording = Recording(tmp_path / "run")
    order = algorithm.order if isinstance(algorithm, GaussSeidel) else None
    for name, step in (("slow", slow), ("fast", 1)):
        ends = np.arange(step, 289, step)
        if order is None:
            read = (ends - step) // 6 % 2
        elif order.index(name) < order.index("source"):
            read = (ends - 1) // 6 % 2
        else:
            read = ends // 6 % 2
        changed = recording[f"{name}.float64.out"]
        copied = recording[f"{name}.copy"]
        assert list(changed.times[1:]) == list(ends * MS)
        numbers = np.array(NUMBERS)[read] / 2 + ends[:, None] / 1000
        np.testing.assert_allclose(changed.values[1:], numbers, rtol=1e-12)
        said = [bytes(1)]
        said += [BYTES[k] + bytes([end % 256]) for k, end in zip(read, ends, strict=True)]
        assert copied.values.tobytes() == b"".join(said)


@pytest.mark.parametrize("others", [0, 4])
def test_the_engine_takes_over_what_python_did_and_nothing_of_its_own(
    others: int, ends3: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two FMUs over several stretches; a component in Python steps so many times between them."""
    taken: list[Time] = []
    take_over = UnitPlan._take_over

    def counted(unit: UnitPlan, t: Time, published: Mapping[str, Signals]) -> None:
        taken.append(t)
        take_over(unit, t, published)

    monkeypatch.setattr(UnitPlan, "_take_over", counted)
    monkeypatch.setattr(plan, "_MOST_POINTS", 100)  # 64, and then so many at once
    kind, stop = FmuComponentType(ends3), 1000
    parts: dict[str, Component] = {name: kind.create(name, {}) for name in ("a", "b")}
    steps = dict.fromkeys(parts, 1_000_000)
    if others:
        parts["python"], steps["python"] = Alternating(), stop * 1_000_000 // (others + 1)
    simulate(
        System(parts, steps, []), GaussSeidel(tuple(parts)),
        start=0, stop=stop * 1_000_000, seed=0, observers=[Recorder(tmp_path)],
    )  # fmt: skip
    assert len(taken) == 2 * (others + 1)
    assert len(set(taken)) == others + 1
