"""The Reference FMUs of the Modelica Association against their reference results.

They are not part of this repository. `NLOSIM_REFERENCE_FMUS` names a folder with `2.0/NAME.fmu` and
`3.0/NAME.fmu`, and beside each its `NAME_out.csv`, beside Feedthrough `Feedthrough_in.csv`.
"""

import csv
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.connection import Connection, Endpoint
from orchestrator.observer import SimulationResult
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Array, Causality, Connector, Signal, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, Time

FOLDER = os.environ.get("NLOSIM_REFERENCE_FMUS")
EVENTFUL = ("BouncingBall", "Feedthrough", "Stair", "StateSpace")
MODELS = ("BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol")
CASES = [
    *(("2.0", name, c, False) for name in MODELS for c in (False, True)),
    *(
        ("3.0", name, compiled, False)
        for name in (*MODELS, "StateSpace")
        for compiled in (False, True)
    ),
    *(("3.0", name, False, True) for name in EVENTFUL),
]
"""FMI version, model, whether compiled code steps it, whether its events are handled with it."""

NOT_IN_2 = {
    *("Float32_continuous_output", "Float32_discrete_output", "Binary_output"),
    *(f"{sign}Int{bits}_output" for sign in ("", "U") for bits in (8, 16, 32, 64)),
} - {"Int32_output"}
"""Outputs of Feedthrough that FMI 2.0 has no types for."""

pytestmark = pytest.mark.skipif(
    FOLDER is None,
    reason="set NLOSIM_REFERENCE_FMUS to a folder with the built Reference FMUs and their results",
)


def results(path: Path) -> dict[str, list[str]]:
    """The columns of a reference result as text, so that times stay exact."""
    with path.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    return {name: [row[name] for row in rows] for name in rows[0]}


def parsed(text: str, value: Signal) -> Signal:
    """A cell of a reference result as a signal like `value`."""
    if isinstance(value, bytes):
        return text.encode()
    if value.dtype.kind == "b":
        return np.array(text == "true")
    return np.array([float(word) for word in text.split()]).reshape(value.shape)


def distance(found: Signal, wanted: Signal) -> float:
    """The largest difference; relative above 1; infinite between texts that differ."""
    if isinstance(found, bytes) or isinstance(wanted, bytes):
        return 0.0 if found == wanted else np.inf
    scale = np.maximum(1.0, np.abs(wanted.astype(float)))
    return float((np.abs(found.astype(float) - wanted.astype(float)) / scale).max(initial=0.0))


def run(
    system: System, times: tuple[Time, Time], folder: Path, *, compiled: bool
) -> tuple[SimulationResult, Recording]:
    """The system from one time to the other [ns]."""
    result = simulate(
        system, Jacobi(), start=times[0], stop=times[1], seed=1,
        observers=[Recorder(folder)], compiled=compiled,
    )  # fmt: skip
    return result, Recording(folder)


@pytest.mark.parametrize(("version", "name", "compiled", "event_mode"), CASES)
def test_reference_results_are_met(
    version: str,
    name: str,
    compiled: bool,  # noqa: FBT001  (a parameter)
    event_mode: bool,  # noqa: FBT001  (a parameter)
    tmp_path: Path,
) -> None:
    """All outputs at every time of the reference, to 1e-12; `Stair` asks for the end at the last.

    Differences of values above 1 are relative.
    """
    folder = Path(FOLDER or "") / version
    expected = results(folder / f"{name}_out.csv")
    times = [round(float(t) * 1e9) for t in expected["time"]]  # some carry rounding errors
    has_choice = version == "3.0" and name in EVENTFUL
    values = {"fmi.event_mode": event_mode} if has_choice else {}
    component = FmuComponentType(folder / f"{name}.fmu").create("unit", values)
    step = times[1] - times[0] if len(times) > 1 else 1_000_000_000
    times = times if len(times) > 1 else [0, step]
    stop = 10_000_000_000 if name == "Stair" else times[-1]
    system = System({"unit": component}, {"unit": step}, [])
    result, recording = run(system, (times[0], stop), tmp_path / "run", compiled=compiled)
    outputs = [n for n, c in component.connectors.items() if c.causality is Causality.OUTPUT]
    columns = [n for n in outputs if n != "h_ft"]  # `h` in feet, in no reference
    assert set(columns) == set(expected) - {"time"} - (NOT_IN_2 if version == "2.0" else set())
    assert (result.time, result.early_end is None) == (times[-1], name != "Stair")
    for k, t in enumerate(times[: len(expected["time"])]):
        for column in columns:
            found = recording[f"unit.{column}"].at(t)
            wanted = _content(column, parsed(expected[column][k], found), expected[column][k])
            assert distance(found, wanted) <= 1e-12, (column, t)


def _content(column: str, wanted: Signal, text: str) -> Signal:
    """Binaries stand in tables as hexadecimal digits."""
    return bytes.fromhex(text) if column.startswith("Binary") else wanted


def test_the_clocks_tick_as_their_description_says() -> None:
    """There is no reference result, but a table of ticks in modelDescription.xml.

    It has ten ticks of `inClock1`, each second from 0 s, `inClock2` at 0, 1, 8 and 9 s, which we
    trigger, `inClock3` at 4 s, which `inClock1` triggers, and `outClock` with each fifth of them
    all. Ticks at the end of a step are in it, triggered ones are at its beginning.
    """
    component = FmuComponentType(Path(FOLDER or "") / "3.0" / "Clocks.fmu").create("unit", {})
    component.setup(0, np.random.default_rng(1))
    rest = {"input2": np.array(0, np.int32), "inClock2": np.array(False)}
    component.initialise(rest)
    names = ("inClock1Ticks", "inClock2Ticks", "inClock3Ticks", "totalInClockTicks", "outClock")
    rows = [[int(np.asarray(component.outputs()[n])) for n in names]]
    second = 1_000_000_000
    for k in range(9):
        component.step({**rest, "inClock2": np.array(k in {0, 1, 8})}, k * second, second)
        rows.append([int(np.asarray(component.outputs()[n])) for n in names])
    component.close()
    for t, (first, triggered, third, total, out) in enumerate(rows):
        assert [first, triggered, third] == [t + 1, sum(k < t for k in (0, 1, 8)), t >= 4]
        assert total == first + triggered + third
        assert out == (t > 0 and total // 5 > rows[t - 1][3] // 5)


class Table(Component):
    """Rows of a reference input; each holds from its time on."""

    def __init__(self, path: Path, inputs: Mapping[str, Connector]) -> None:
        columns = results(path)
        self._times = [round(float(t) * 1e9) for t in columns.pop("time")]
        self.rows: list[dict[str, Array]] = [
            {n: np.array(int(cells[k]), inputs[n].dtype) for n, cells in columns.items()}
            for k in range(len(self._times))
        ]
        self._connectors = {
            n: Connector(causality=Causality.OUTPUT, dtype=inputs[n].dtype) for n in columns
        }
        self._row = self.rows[0]

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._row = self.rows[0]

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._row = self.rows[sum(each <= t + h for each in self._times) - 1]

    @override
    def outputs(self) -> Signals:
        return self._row


@pytest.mark.parametrize("event_mode", [False, True])
def test_the_reference_inputs_are_fed_through(
    event_mode: bool,  # noqa: FBT001  (a parameter)
    tmp_path: Path,
) -> None:
    """The extreme values of all integers arrive, a step after they were published."""
    folder = Path(FOLDER or "") / "3.0"
    values = {"fmi.event_mode": event_mode}
    component = FmuComponentType(folder / "Feedthrough.fmu").create("unit", values)
    table = Table(folder / "Feedthrough_in.csv", component.connectors)
    links = [Connection(Endpoint("table", n), Endpoint("unit", n)) for n in table.connectors]
    step = 100_000_000
    system = System({"table": table, "unit": component}, {"table": step, "unit": step}, links)
    _, recording = run(system, (0, 2_000_000_000), tmp_path / "run", compiled=True)
    for k in range(21):
        for name, value in table.rows[k > 10].items():
            found = recording[f"unit.{name.replace('input', 'output')}"].at(k * step)
            assert found.tolist() == value.tolist(), (name, k)  # type: ignore[union-attr]
