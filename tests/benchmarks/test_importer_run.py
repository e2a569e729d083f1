"""The benchmark of importers: all participants give the same values, and say what they took."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from benchmarks.benchmark import Case, Measurement
from benchmarks.importer import ImporterBenchmark, benchmark, ecos, omsimulator
from benchmarks.importer.benchmark import CHAINS, PEERS, SIDE, TARGET_US
from benchmarks.importer.chain import STEP_NS, Chain, DifferentResultError
from benchmarks.importer.ecos import EcosRun
from benchmarks.importer.floor import FloorRun
from benchmarks.importer.fmpy_loop import FmpyRun
from benchmarks.importer.matrix import MatrixRun
from benchmarks.importer.model import Model, fmu
from benchmarks.importer.omsimulator import OmsimulatorRun
from benchmarks.importer.ours import OursRun
from benchmarks.settings import WholeNumberError
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.plan.plan import RunPlan
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import Transformation
from tests.benchmarks.schema import ONE

STEPS = 101
SHORT = [Chain(kind, version, 3) for kind in ("gain", "feedthrough") for version in (2, 3)]
needs_ecos = pytest.mark.skipif(bool(ecos.WHY_NOT), reason=f"no ecos: {ecos.WHY_NOT}")


def check(case: Case) -> Measurement:
    """Measuring compares the last values with those that the FMUs should give."""
    found = case.measure()
    assert 0.0 < found["step_us"] < 1e5
    return found


@pytest.mark.parametrize("chain", SHORT, ids=lambda chain: chain.name)
def test_all_participants_give_the_same(chain: Chain) -> None:
    for compiled in (True, False):
        found = check(OursRun(chain=chain, steps=STEPS, compiled=compiled))
        assert 0.0 < found["recording_us"] < found["step_us"]
    for prepared in (True, False):
        check(FmpyRun(chain=chain, steps=STEPS, prepared=prepared))
    for is_shared in (True, False):
        check(FloorRun(chain=chain, steps=STEPS, is_shared=is_shared))


@needs_ecos
@pytest.mark.parametrize("kind", ["gain", "feedthrough"])
def test_ecos_gives_the_same_a_step_later_for_each_fmu(kind: str) -> None:
    check(EcosRun(chain=Chain(kind, 2, 3), steps=STEPS))


@pytest.mark.skipif(bool(omsimulator.WHY_NOT), reason=f"no OMSimulator: {omsimulator.WHY_NOT}")
@pytest.mark.parametrize("chain", SHORT, ids=lambda chain: chain.name)
def test_omsimulator_gives_the_same_a_step_later_for_each_fmu(
    chain: Chain, capfd: pytest.CaptureFixture[str]
) -> None:
    check(OmsimulatorRun(chain=chain, steps=STEPS))
    assert not capfd.readouterr().out


def test_the_last_values_of_a_chain() -> None:
    """The source counts; each Gain multiplies by 0.999, a Feedthrough gives on what it gets."""
    assert Chain("gain", 2, 3).last(1000) == {"Real_out_1": pytest.approx(0.999**2)}
    assert Chain("feedthrough", 3, 50).last(301) == {
        "Float32_out_1": 301, "Float64_out_1": 0.301, "Float64_out_2": 0.602, "Int32_out_1": 301,
        "Int64_out_1": 301, "UInt8_out_1": 45, "Boolean_out_1": 1,
    }  # fmt: skip


def test_another_value_is_refused() -> None:
    chain = Chain("gain", 2, 2)
    nearly = {"Real_out_1": np.nextafter(chain.last(5)["Real_out_1"], 1.0).item()}
    chain.check("we", chain.last(5), 5)
    with pytest.raises(DifferentResultError, match=r"gain-fmi2/2: we found .*, not "):
        chain.check("we", nearly, 5)


@pytest.mark.parametrize("chain", SHORT, ids=lambda chain: chain.name)
def test_fmus_offer_what_their_models_say(chain: Chain) -> None:
    for model in (chain.source, chain.follower):
        connectors = FmuComponentType(fmu(model)).create("it", {}).connectors
        assert set(connectors) == {each.name for each in model.variables()}
        assert not any(connector.feedthrough for connector in connectors.values())


def test_models_of_one_name_are_different_fmus() -> None:
    sizes = [(3,), (5,)]
    chains = [Chain("matrix", 3, 2, size) for size in sizes]
    found = [FmuComponentType(fmu(chain.source)).create("it", {}).connectors for chain in chains]
    assert [each["Float64_out_1"].shape for each in found] == sizes


@pytest.mark.parametrize("factor", [1e308, -1e308])
@pytest.mark.parametrize("version", [2, 3])
def test_infinity_ends_a_run_at_the_same_point(tmp_path: Path, factor: float, version: int) -> None:
    """The source is at 1.797 after 1797 steps, and 1e308 times more than that is no double."""
    counts = Chain("gain", version, 2).source.counts
    name = f"overflow_{'down' if factor < 0 else 'up'}"
    source = Model(name="ramp", version=version, counts=counts, is_source=True)
    models = {"a": source, "b": Model(name=name, version=version, counts=counts, factor=factor)}
    errors = []
    for compiled in (True, False):
        components = {n: FmuComponentType(fmu(model)).create(n, {}) for n, model in models.items()}
        a, b = (Endpoint(n, next(iter(components[n].connectors))) for n in models)
        system = System(components, dict.fromkeys(models, STEP_NS), [Connection(a, b)])
        with pytest.raises(ComponentError, match=r"^component `b` at t = 1\.797 s: ") as caught:
            simulate(
                system, GaussSeidel(("a", "b")), start=0, stop=2000 * STEP_NS, seed=0,
                compiled=compiled, observers=[Recorder(tmp_path / str(compiled))],
            )  # fmt: skip
        errors.append(str(caught.value))
    assert errors[0] == errors[1]


class Spike(Component):
    """Nineteen ones; from the second step on one of them is 1e300."""

    connectors = {"x": Connector(causality=Causality.OUTPUT, shape=(19,))}  # noqa: RUF012

    def __init__(self, place: int) -> None:
        self._place = place

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = np.ones(19)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._x = np.ones(19)
        self._x[self._place] = 1e300 if t else 1.0

    @override
    def outputs(self) -> Signals:
        return {"x": self._x}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_infinity_is_seen_at_every_place(monkeypatch: pytest.MonkeyPatch, sign: float) -> None:
    """Of nineteen numbers, which are checked eight at a time."""
    stretches: list[Time] = []
    run = RunPlan.run

    def noted(self: RunPlan, t: Time, *rest: Any) -> Any:
        stretches.append(t)
        return run(self, t, *rest)

    monkeypatch.setattr(RunPlan, "run", noted)
    row = FmuComponentType(fmu(Chain("matrix", 3, 2, (19,)).follower))
    wire = Connection(
        Endpoint("x", "x"), Endpoint("row", "Float64_in_1"), Transformation(gain=sign * 1e10)
    )
    for place in range(19):
        system = System(
            {"row": row.create("row", {}), "x": Spike(place)},
            {"row": STEP_NS, "x": 8 * STEP_NS}, [wire],
        )  # fmt: skip
        said = r"^component `row` at t = 0\.016 s: .* `Float64_in_1` is not finite$"
        with pytest.raises(ComponentError, match=said):
            simulate(system, Jacobi(), start=0, stop=80 * STEP_NS, seed=0)
        assert stretches.pop() == 16 * STEP_NS


def test_a_matrix_is_measured_beside_copies() -> None:
    found = check(MatrixRun(side=20, steps=STEPS))
    assert 0.0 < found["memcpy_us"] < found["step_us"]
    assert 0.0 < found["numpy_us"] < found["step_us"]
    assert 0.0 < found["floor_us"] < found["step_us"]


def test_rows_compare_with_every_peer_that_was_measured() -> None:
    one = {"recording_us": 0.1, "floor_us": 14.0, "numpy_us": 10.0, "memcpy_us": 5.0}
    measured: dict[str, list[Measurement]] = {
        name: [
            {**one, "step_us": n * (1.0 if name.endswith("/nlosim") else 8.0)} for n in (1, 2, 9)
        ]
        for name in ImporterBenchmark().cases()
    }
    rows = {row.case: row for row in ImporterBenchmark().rows(measured)}
    assert set(rows) == {
        *(name for name in measured if not name.endswith("/nlosim") and "matrix" not in name),
        *(f"matrix/{SIDE}x{SIDE}/{copy}" for copy in ("floor", "numpy", "memcpy")),
    }
    for chain in CHAINS:
        row = rows[f"{chain.name}/fmpy"]
        assert (row.ours, row.low, row.high, row.peer, row.ratio) == (2.0, 1.0, 9.0, 16.0, 8.0)
        assert row.peer_name == PEERS["fmpy"]
        assert (row.details["peer_low_us"], row.details["peer_high_us"]) == (8.0, 72.0)
        assert row.details.get("target_us") == (TARGET_US if chain.kind == "gain" else None)
    assert rows[f"matrix/{SIDE}x{SIDE}/memcpy"].ratio == 5.0 / 16.0
    alone = {name: runs for name, runs in measured.items() if name.endswith("/nlosim")}
    found = ImporterBenchmark().rows(alone)
    assert [row.case for row in found] == [chain.name for chain in CHAINS]
    assert all(row.ratio is None for row in found)


def test_who_is_left_out_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ecos, "WHY_NOT", "No module named 'ecospy'")
    monkeypatch.setattr(omsimulator, "WHY_NOT", "")
    assert ImporterBenchmark().peer.endswith("; left out: ecos (No module named 'ecospy')")
    names = [name.rpartition("/")[2] for name in ImporterBenchmark().cases()]
    assert names.count("ecos") == 0
    assert names.count("omsimulator") == len(CHAINS)
    monkeypatch.setattr(omsimulator, "WHY_NOT", "not here")
    assert ImporterBenchmark().peer.endswith("ecospy'); left out: OMSimulator (not here)")
    assert not any(name.endswith("/omsimulator") for name in ImporterBenchmark().cases())


def test_the_number_of_steps_can_be_set() -> None:
    made = ImporterBenchmark()
    made.configure({"steps": "500"})
    assert made.settings == {"steps": "500"}
    case = made.cases()["gain-fmi2/10/nlosim"]
    assert isinstance(case, OursRun)
    assert case == dataclasses.replace(case, steps=500, compiled=True)
    message = "`steps` is `99`; write a whole number from 100 on"
    with pytest.raises(WholeNumberError, match=message):
        made.configure({"steps": "99"})


@pytest.mark.slow
def test_the_command_measures_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmark, "CHAINS", (Chain("gain", 2, 2),))
    arguments = ["importer", "--set", "steps=100", "--repeat", "1", "--case", "gain*", "--json"]
    assert main(["bench", *arguments]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, ONE)
    cases = {row["case"].removeprefix("gain-fmi2/2/") for row in found["rows"]}
    assert cases | {"ecos", "omsimulator"} == set(PEERS)
