"""The benchmark of the city: what its cases give, and what is made of the measurements."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from adapters.sumo.parameters import TrafficParameters
from benchmarks.benchmark import Measurement
from benchmarks.page import page
from benchmarks.scene import SceneBenchmark, benchmark, work
from benchmarks.scene.benchmark import Adapter, CityRun
from benchmarks.scene.process import MeasurementError, apart, peak_mib
from benchmarks.settings import WholeNumberError


@pytest.mark.slow
def test_a_run_says_what_it_took() -> None:
    found = CityRun(scenario="city", vehicles=100, seconds=1).measure()
    assert found["simulated_s"] == 1.0
    assert found["radios"] == pytest.approx(100, rel=0.06)
    assert found["lidars"] == 0.0
    assert 0.0 < found["cpu_s"] < 60.0
    assert 0.0 < found["loading_s"] < 60.0
    assert 20.0 < found["peak_mib"] < 2000.0
    assert found["recorded_bytes"] > 100_000
    parts = ("traffic_s", "channel_s", "facilities_s", "recording_s", "orchestrator_s")
    spent = sum(found[part] for part in parts)
    assert spent + found["loading_s"] == pytest.approx(found["wall_s"], rel=1e-6)


BURNER = "import time\nx = b'x' * 300_000_000\nwhile time.process_time() < 0.5: pass"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not tell of other processes")
def test_processes_that_were_started_count() -> None:
    cpu = work.cpu_s()
    subprocess.run([sys.executable, "-c", BURNER], check=True)
    assert work.cpu_s() - cpu >= 0.45
    if memory := peak_mib():  # only Linux tells
        assert memory["peak_mib"] >= 3e8 / 2**20 + 20.0  # of that process and of this one


@pytest.mark.slow
def test_the_component_and_sumo_alone_are_measured() -> None:
    found = Adapter(vehicles=100, seconds=3).measure()
    assert 0.0 < found["sumo_cpu_s"] < 60.0
    assert 0.0 < found["cpu_s"] < 60.0


def test_both_step_the_same_scene_as_often(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def apart(function: Any, parameters: TrafficParameters, steps: int) -> Measurement:
        asked.append((parameters, steps))
        return {"cpu_s": {work.adapter: 2.0, work.sumo: 1.0}[function]}

    monkeypatch.setattr(benchmark, "apart", apart)
    found = Adapter(vehicles=100, seconds=3).measure()
    assert found == {"cpu_s": 2.0, "sumo_cpu_s": 1.0, "simulated_s": 3}
    (first, second) = asked
    assert first == second
    assert first[1] == 30
    assert first[0].scale == pytest.approx(0.1)


def test_work_apart_says_what_failed() -> None:
    with pytest.raises(MeasurementError, match=r"`adapter`: ParameterError: .*nowhere\.sumocfg"):
        apart(work.adapter, TrafficParameters(scene=Path("nowhere.sumocfg")), 1)


def test_rows_compare_with_targets_and_with_sumo() -> None:
    one = {"simulated_s": 20.0, "radios": 300.0, "peak_mib": 200.0, "channel_s": 4.0}
    one |= {"loading_s": 1.5}
    measured: dict[str, list[Measurement]] = {
        "radios/100": [{**one, "wall_s": 1.0, "cpu_s": 2.0, "recorded_bytes": 2e7}],
        "radios/300": [
            {**one, "wall_s": wall, "cpu_s": 1.6 * wall, "recorded_bytes": 2e8}
            for wall in (8.0, 5.0, 10.0)
        ],
        "traffic/300": [{"simulated_s": 20.0, "cpu_s": 0.5, "sumo_cpu_s": 0.4}],
    }
    without, radios, traffic = SceneBenchmark().rows(measured)
    assert (without.ours, without.peer, without.ratio) == (20.0, None, None)
    assert (radios.ours, radios.low, radios.high) == (2.5, 2.0, 4.0)
    assert (radios.peer, radios.peer_name, radios.ratio) == (5.0, "target", 0.5)
    assert (radios.unit, traffic.unit) == ("simulated s / s", "simulated s / CPU s")
    assert radios.details == {
        "simulated_s_per_cpu_s": pytest.approx(20.0 / 12.8),
        "loading_s": 1.5,
        "radios": 300.0,
        "peak_mib": 200.0,
        "channel_s_per_s": 0.2,
        "recorded_mb_per_s": 10.0,
    }
    assert (traffic.ours, traffic.peer, traffic.peer_name) == (40.0, 50.0, "SUMO alone")
    assert traffic.ratio == pytest.approx(0.8)


def test_the_duration_can_be_set() -> None:
    benchmark = SceneBenchmark()
    benchmark.configure({"seconds": "3"})
    assert benchmark.settings == {"seconds": "3"}
    assert {case.seconds for case in benchmark.cases().values()} == {3}  # type: ignore[attr-defined]
    with pytest.raises(WholeNumberError, match=r"`seconds` is `0.5`; write a whole number"):
        benchmark.configure({"seconds": "0.5"})


def test_the_page_takes_the_result(tmp_path: Path) -> None:
    row = SceneBenchmark().rows(
        {"traffic/300": [{"simulated_s": 20.0, "cpu_s": 0.5, "sumo_cpu_s": 0.4}]}
    )[0]
    assert page([_result(tmp_path, row.as_json())]).count("| traffic/300 | 40 |") == 1


def _result(folder: Path, row: object) -> Path:
    machine = {"cpu": "x", "cpus": 2, "memory_gib": 4, "platform": "y", "load_average": 0.0}
    found = {
        "name": "scene", "description": SceneBenchmark().description, "peer": "", "rows": [row],
        "repetitions": 1, "commit": "c", "created": "today", "machine": machine, "versions": {},
    }  # fmt: skip
    path = folder / "bench-scene.json"
    path.write_text(json.dumps(found))
    return path
