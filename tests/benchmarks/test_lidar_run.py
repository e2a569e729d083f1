"""The lidar benchmark: both casters see the same, and what is made of the measurements."""

from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.benchmark import Measurement
from benchmarks.lidar import LidarBenchmark, embree
from benchmarks.lidar.benchmark import TARGETS, WORKLOADS
from benchmarks.lidar.case import CastingRun, EverythingRun, Workload
from benchmarks.lidar.caster import Caster, Hits
from benchmarks.lidar.pattern import Pattern
from benchmarks.lidar.town import SCANS, town
from fmus.messages.records import POINT, SENSOR, unframe
from orchestrator import registry
from orchestrator.cli import main

needs_embree = pytest.mark.skipif(
    not embree.is_embree_installed(), reason="embreex is not installed"
)
LEVEL, TILTED = Pattern(reach=100.0), Pattern(pitch=0.05, roll=0.03)
FEW = Workload(name="few", vehicles=5, sensors=2, pattern=Pattern(channels=4, azimuths=16))


def both_see(pattern: Pattern) -> Iterator[tuple[Hits, Hits]]:
    place = town(300, 2)
    ours, theirs = Caster(place, pattern), embree.Embree(place, pattern)
    for scan in (0, SCANS - 1):
        ours.show(scan)
        theirs.show(scan)
        for sensor in (0, 1):
            ours.cast(scan, sensor)
            theirs.cast(scan, sensor)
            yield ours.hits(), theirs.hits(scan)
    ours.close()


@pytest.mark.slow
@needs_embree
@pytest.mark.parametrize("pattern", [LEVEL, TILTED], ids=["level", "tilted"])
def test_the_peer_sees_the_same(pattern: Pattern) -> None:
    """In float32: a ray in 10,000 may pass an edge on the other side."""
    for ours, theirs in both_see(pattern):
        same = ours.instance == theirs.instance
        assert (~same).sum() < 1e-4 * pattern.rays
        hit = same & np.isfinite(ours.distance)
        np.testing.assert_allclose(theirs.distance[hit], ours.distance[hit], rtol=0, atol=2e-3)
        for is_kind in (ours.instance <= -2, ours.instance == -1, ours.instance >= 1):
            assert is_kind.sum() > 1000, "ground, buildings and vehicles are in view"


@pytest.mark.parametrize("pattern", [LEVEL, TILTED], ids=["level", "tilted"])
def test_the_caster_hits_what_the_installed_lidar_reports(pattern: Pattern) -> None:
    place = town(100, 1)
    caster = Caster(place, pattern)
    caster.show(0)
    caster.cast(0, 0)
    hits = caster.hits()
    caster.close()
    parameters = {**pattern.parameters(), "range_noise": 0.0, "dropout": 0.0}
    component = registry.component_type("lidar").create("lidar", parameters)
    component.setup(0, np.random.default_rng(0))
    component.initialise(place.inputs()[0])
    signal = component.outputs()["points"]
    component.close()
    assert isinstance(signal, bytes)
    points = np.frombuffer(signal, POINT, offset=16 + unframe("LPTS", signal, SENSOR).nbytes)
    hit = np.isfinite(hits.distance)
    assert np.array_equal(points["instance"], hits.instance[hit])
    distance = np.linalg.norm(points["position"].astype(float), axis=1)
    np.testing.assert_allclose(distance, hits.distance[hit], rtol=0, atol=1e-5)


@pytest.mark.parametrize("ours", [True, pytest.param(False, marks=needs_embree)])
def test_casting_is_measured(*, ours: bool) -> None:
    found = CastingRun(workload=FEW, ours=ours).measure()
    assert 0 < found["scene_ms"] <= found["cpu_ms"] < 1000


def test_everything_is_measured() -> None:
    found = EverythingRun(workload=FEW).measure()
    assert 0 < found["fmu_ms"] <= found["cpu_ms"] < 1000
    assert 0 < found["points"] <= FEW.sensors * FEW.pattern.rays
    assert found["start_ms"] < 1000, "nothing is compiled at the first run"


@needs_embree
def test_rows_compare_the_casting_with_that_of_the_peer() -> None:
    measured: dict[str, list[Measurement]] = {
        name: [dict.fromkeys(("cpu_ms", "scene_ms", "fmu_ms", "start_ms", "points"), n)
               for n in ((1.0, 2.0, 9.0) if "embree" not in name else (8.0, 20.0, 60.0))]
        for name in LidarBenchmark().cases()
    }  # fmt: skip
    rows = {row.case: row for row in LidarBenchmark().rows(measured)}
    assert len(rows) == 2 * len(WORKLOADS)
    assert set(TARGETS) <= set(rows)
    for name, row in rows.items():
        assert (row.ours, row.low, row.high) == (2.0, 1.0, 9.0)
        assert row.ratio == (10.0 if name.startswith("casting/") else None)
        assert row.details.get("target_ms") == TARGETS.get(name)
    only_ours = {name: runs for name, runs in measured.items() if not name.endswith("/embree")}
    assert all(row.ratio is None for row in LidarBenchmark().rows(only_ours))


def test_without_embree_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(embree, "EmbreeScene", None)
    assert main(["bench", "lidar"]) == 2
    message = "beside Embree, and embreex is not installed: `pip install 'nlosim[bench]'`"
    assert message in capsys.readouterr().err
