"""FMI 3.0: clocks tick at their times, let values in and out, and are connected."""

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.component import RestorableFmuComponent
from adapters.fmi.errors import FmuError
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.connection import Connection, Endpoint
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Signal
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.descriptions import changed

S = 1_000_000_000
RESTING: Mapping[str, Signal] = {
    "fuse": np.array(0.0),
    "sample": np.array(1.0),
    "pull": np.array(False),
}


def begun(path: Path) -> RestorableFmuComponent:
    component = FmuComponentType(path).create("unit", {})
    assert isinstance(component, RestorableFmuComponent)
    component.setup(0, np.random.default_rng(1))
    component.initialise(RESTING)
    return component


def found(component: Component, *names: str) -> list[float]:
    return [float(np.asarray(component.outputs()[name])) for name in names]


COUNTS = ("n_every", "n_asked", "n_changing")


def test_connectors_are_triggered_clocks_and_clocked_variables(clocks3: Path) -> None:
    kind = FmuComponentType(clocks3)
    connectors = kind.create("unit", {}).connectors
    assert {n: c.kind() for n, c in connectors.items() if c.causality is Causality.INPUT} == {
        "pull": "bool[]",
        "fuse": "float64[]",
        "sample": "float64[]",
    }
    assert connectors["alarm"].kind() == "bool[]"
    assert connectors["alarm"].causality is Causality.OUTPUT
    assert {"n_every", "sampled", "order"} <= set(connectors)
    assert "fmi.event_mode" not in kind.parameters  # the standard leaves no choice
    assert kind.description == "Clocks of all kinds, whose ticks are counted"


def test_time_based_clocks_tick_at_their_times(clocks3: Path) -> None:
    """The FMU checks the times; by t it has counted as many as their formulas say."""
    component = begun(clocks3)
    assert found(component, *COUNTS, "at") == [0, 1, 0, 0]  # a third of a second has no shift
    for k in range(8):
        component.step(RESTING, k * S // 4, S // 4)
        t = (k + 1) / 4
        changing = sum(0.1 * n * (n + 1) / 2 <= t + 1e-12 for n in range(1, 20))
        every = sum(0.1 + 0.3 * n <= t + 1e-12 for n in range(20))
        assert found(component, *COUNTS) == [every, 1 + int(3 * t + 1e-12), changing]
    component.close()


def test_ticks_at_one_time_go_by_priority(clocks3: Path) -> None:
    """At 1 s `asked` (1), `every` (2) and `changing` (3) tick, whose references are 2, 1 and 3."""
    component = begun(clocks3)
    component.step(RESTING, 0, S)
    assert component.outputs()["order"] == b"213"
    assert found(component, "at") == [1]
    component.close()


def test_a_triggered_clock_ticks_for_every_true_and_samples_its_input(clocks3: Path) -> None:
    """At the beginning of the step; what comes while it rests waits, and is given at once."""
    component = begun(clocks3)
    pulled = np.array(True)
    rows = []
    for k, (sample, pull) in enumerate([(2.0, False), (3.0, True), (3.0, True), (4.0, False)]):
        clock = {"pull": pulled} if pull else {}
        inputs = {**RESTING, "sample": np.array(sample), **clock}
        component.step(inputs, k * S // 100, S // 100)
        rows.append(found(component, "n_pull", "sampled"))
    assert rows == [[0, 0], [1, 3], [2, 3], [2, 3]]
    component.close()


def test_an_output_clock_says_whether_it_ticked_within_the_step(clocks3: Path) -> None:
    """`alarm` ticks with every third tick of `every`, at 0.7 s and 1.6 s."""
    component = begun(clocks3)
    rows = []
    for k in range(10):
        component.step(RESTING, k * S // 5, S // 5)
        rows.append(found(component, "alarm", "n_alarm"))
    assert rows == [[k in {3, 7}, int(k >= 3) + int(k >= 7)] for k in range(10)]
    component.close()


def test_a_local_clock_is_no_output_and_lets_outputs_out(clocks3: Path, tmp_path: Path) -> None:
    """FMI 3.0.2, section 2.2.8: clocks may be local; `n_alarm` is read while `alarm` ticks."""
    outer, inner = (
        b'name="alarm" valueReference="6" causality="%s"' % c for c in (b"output", b"local")
    )
    path = changed(
        clocks3, tmp_path, (outer, inner), (b'<Output valueReference="6" dependencies="1"/>', b"")
    )
    component = begun(path)
    rows = []
    for k in range(10):
        component.step(RESTING, k * S // 5, S // 5)
        rows += found(component, "n_alarm")
    assert rows == [int(k >= 3) + int(k >= 7) for k in range(10)]
    assert "alarm" not in component.outputs()
    component.close()


@pytest.mark.parametrize(
    ("fuse", "ticks"), [(0.15, [0, 0, 1, 1]), (0.1, [0, 1, 1, 1]), (0.05, [0, 2, 2, 2])]
)
def test_a_countdown_begins_with_an_event(clocks3: Path, fuse: float, ticks: list[int]) -> None:
    """It is lit at 0.1 s; a fuse of 0.05 s is followed by another tick at the same time."""
    component = begun(clocks3)
    rows: list[float] = []
    lit = np.array(fuse)
    for k in range(4):
        component.step({**RESTING, "fuse": lit if k else RESTING["fuse"]}, k * S // 10, S // 10)
        rows.append(*found(component, "n_countdown"))
    assert rows == ticks
    component.close()


def test_ticks_to_come_are_part_of_the_state(clocks3: Path) -> None:
    component = begun(clocks3)
    lit = {**RESTING, "fuse": np.array(0.9)}
    component.step(lit, 0, S // 2)
    state, before = component.save(), component.outputs()
    for _ in range(2):
        component.step(lit, S // 2, S // 2)
        assert found(component, *COUNTS, "n_countdown") == [4, 4, 4, 1]
        component.restore(state)
        assert component.outputs() == before
    assert component.capability(PortableState) is None  # type: ignore[type-abstract]
    component.close()


def test_a_clock_drives_a_clock(clocks3: Path, tmp_path: Path) -> None:
    """The alarm of one is the pull of the other, a step later; all is recorded."""
    type_ = FmuComponentType(clocks3)
    components: dict[str, Component] = {n: type_.create(n, {}) for n in ("first", "second")}
    links = [
        Connection(Endpoint("first", "alarm"), Endpoint("second", "pull")),
        Connection(Endpoint("first", "at"), Endpoint("second", "sample")),
    ]
    system = System(components, dict.fromkeys(components, S // 5), links)
    simulate(system, Jacobi(), start=0, stop=2 * S, seed=1, observers=[Recorder(tmp_path / "run")])
    recording = Recording(tmp_path / "run")
    pulls = [int(recording["second.n_pull"].at(k * S // 5)) for k in range(11)]
    assert pulls == [0] * 5 + [1] * 4 + [2] * 2
    # the last tick of the first one by 0.8 s is that of `every` at 0.7 s
    assert float(recording["second.sampled"].at(S)) == pytest.approx(0.7)
    assert [int(v) for v in recording["first.alarm"].values] == [k in {4, 8} for k in range(11)]


def without(flag: bytes, path: Path, target: Path) -> Path:
    return replaced(path, target, flag + b'="true"', b"")


def replaced(path: Path, target: Path, text: bytes, by: bytes) -> Path:
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(text, by))
    return target


@pytest.mark.parametrize("interval", ["0", "-0.3"])
def test_a_clock_without_an_interval_is_refused(
    clocks3: Path, tmp_path: Path, interval: str
) -> None:
    said = f'intervalDecimal="{interval}"'.encode()
    path = replaced(clocks3, tmp_path / "still.fmu", b'intervalDecimal="0.3"', said)
    with pytest.raises(FmuError, match=f"the clock `every` has the interval {interval} s"):
        begun(path)


def test_a_clock_that_knows_no_fractions_is_asked_for_decimals(
    clocks3: Path, tmp_path: Path
) -> None:
    """They are the decimals that are meant: 0.05 s and each 0.25 s from then on."""
    component = begun(without(b"supportsFraction", clocks3, tmp_path / "decimal.fmu"))
    counts: list[float] = []
    for k in range(8):
        component.step(RESTING, k * S // 4, S // 4)
        counts.append(*found(component, "n_asked"))
    assert counts == [1, 2, 3, 4, 5, 6, 7, 8]
    component.close()


def test_clocks_without_event_mode_are_left_out(clocks3: Path, tmp_path: Path) -> None:
    kind = FmuComponentType(without(b"hasEventMode", clocks3, tmp_path / "silent.fmu"))
    assert "`every` (clocks need `hasEventMode`), `asked`" in kind.description
    assert list(kind.create("unit", {}).connectors) == ["fuse"]
