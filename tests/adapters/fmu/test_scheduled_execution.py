"""FMI 3.0, Scheduled Execution: model partitions run when clocks tick, by time and priority."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.component import RestorableFmuComponent
from adapters.fmi.errors import FmuError
from orchestrator.signal import Signal

S = 1_000_000_000
RESTING: Mapping[str, Signal] = {
    "sample": np.array(1.0),
    "pull": np.array(False),
    "plain": np.array(0.0),
}


def begun(path: Path, **values: float) -> RestorableFmuComponent:
    component = FmuComponentType(path).create("unit", values)
    assert isinstance(component, RestorableFmuComponent)
    component.setup(0, np.random.default_rng(1))
    component.initialise(RESTING)
    return component


def number(component: RestorableFmuComponent, name: str) -> float:
    return float(np.asarray(component.outputs()[name]))


def expected(stop: float, delay: float) -> bytes:
    """Who runs by `stop` [s]: `f` each 0.1 s, `s` each 0.25 s from 0.1 s, `l` after every other."""
    runs = [(round(0.1 * n, 9), 2, b"f") for n in range(100)]
    slow = [round(0.1 + 0.25 * n, 9) for n in range(40)]
    runs += [(t, 1, b"s") for t in slow]
    runs += [(round(t + delay, 9), 3, b"l") for t in slow[1::2]]
    return b"".join(name for t, _, name in sorted(runs) if t <= stop + 1e-9)


@pytest.mark.parametrize("delay", [0.03, 0.25, 0.0])
@pytest.mark.parametrize("step", [1_000_000_000, 50_000_000, 70_000_000])
def test_partitions_run_in_order_whatever_the_step(
    partitions3: Path, delay: float, step: int
) -> None:
    """Those at the start end initialisation; each later one is in the step that ends behind it."""
    component = begun(partitions3, delay=delay)
    assert component.outputs()["log"] == b"f"
    for k in range(3 * S // step):
        component.step(RESTING, k * step, step)
        assert component.outputs()["log"] == expected((k + 1) * step / 1e9, delay)
        assert number(component, "n_fast") == 1 + (k + 1) * step // (S // 10)
    component.close()


def test_triggered_partitions_run_at_the_beginning_of_a_step(partitions3: Path) -> None:
    component = begun(partitions3)
    pulled = {**RESTING, "pull": np.array(True)}
    rows = []
    for k, inputs in enumerate([RESTING, pulled, pulled, RESTING]):
        component.step(inputs, k * S // 100, S // 100)
        rows.append((number(component, "out"), number(component, "n_out")))
    assert rows == [(0, 0), (1, 1), (1, 2), (0, 2)]
    assert component.outputs()["log"] == b"fpp"
    component.close()


def test_inputs_are_set_before_what_is_triggered_with_them(partitions3: Path) -> None:
    component = begun(partitions3)
    both = {**RESTING, "pull": np.array(True), "plain": np.array(5.0)}
    component.step(both, 0, S // 100)
    assert number(component, "pulled") == 5
    component.step({**RESTING, "plain": np.array(6.0)}, S // 100, S // 100)
    assert number(component, "pulled") == 5
    component.close()


def test_clocked_inputs_wait_for_their_partition(partitions3: Path) -> None:
    """`slow` runs at 0.1 and 0.35 s, with what the step in which it runs began with."""
    component = begun(partitions3)
    sampled = []
    for k in range(5):
        component.step({**RESTING, "sample": np.array(10.0 + k)}, k * S // 10, S // 10)
        sampled.append(number(component, "sampled"))
    assert sampled == [10, 10, 10, 13, 13]
    component.close()


def test_what_is_to_run_is_part_of_the_state(partitions3: Path) -> None:
    component = begun(partitions3, delay=0.2)
    component.step(RESTING, 0, 4 * S // 10)
    state = component.save()
    for _ in range(2):
        component.step(RESTING, 4 * S // 10, 6 * S // 10)
        assert component.outputs()["log"] == expected(1, 0.2)
        component.restore(state)
    component.close()


def test_errors_pass_through_the_fmu(partitions3: Path) -> None:
    """What goes wrong while the FMU calls us is an error of the step."""
    component = begun(partitions3, delay=-0.5)
    with pytest.raises(FmuError, match=r"the clock `later` has the interval -0\.5 s"):
        component.step(RESTING, 0, S)
    component.close()


def test_the_description_says_what_it_is(partitions3: Path) -> None:
    kind = FmuComponentType(partitions3)
    assert kind.description == "Model partitions that write down when they ran"
    assert "fmi.event_mode" not in kind.parameters
    component = kind.create("unit", {})
    assert {"pull", "sample", "out", "log"} <= set(component.connectors)
    assert "fast" not in component.connectors
