"""The cities: what the script makes is what ships, and streets are full from the beginning."""

import gzip
import os
import re
from collections import Counter
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import shapely

import scenarios
from adapters.sumo import SumoTraffic
from adapters.sumo.headless import with_stand_ins
from adapters.sumo.parameters import TrafficParameters
from adapters.traffic.bodies import Body
from orchestrator.errors import ParameterError
from orchestrator.signal import Signals
from scenarios.assets.city.make import NETS, make, netgenerate
from scenarios.assets.city.streets import read_streets

ASSETS = Path(scenarios.__file__).parent / "assets" / "city"
H = 100_000_000


def text(folder: Path, name: str, kind: str) -> str:
    return gzip.decompress((folder / f"{name}.{kind}.xml.gz").read_bytes()).decode()


def outlines(name: str) -> list[shapely.Polygon]:
    """The ground plans of the buildings that ship."""
    shapes = re.findall(r'shape="([^"]*)"', text(ASSETS, name, "poly"))
    return [
        shapely.Polygon([tuple(map(float, point.split(","))) for point in shape.split()])
        for shape in shapes
    ]


@pytest.mark.skipif(netgenerate() is None, reason="netgenerate is not installed (nlosim[net])")
@pytest.mark.parametrize("name", NETS)
def test_the_script_makes_what_ships(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable, value in with_stand_ins(os.environ).items():
        monkeypatch.setenv(variable, value)
    make(tmp_path, name)
    for kind in ("net", "poly", "rou"):
        assert text(tmp_path, name, kind) == text(ASSETS, name, kind), f"{kind}: run `make net`"


def test_all_files_together_are_small() -> None:
    assert sum(path.stat().st_size for path in ASSETS.iterdir() if path.is_file()) < 500_000


@pytest.mark.parametrize("name", NETS)
def test_buildings_are_neither_on_a_lane_nor_in_each_other(name: str) -> None:
    found = outlines(name)
    assert len(found) > 500
    assert len({(plan.area, plan.length) for plan in found}) > 400, "they differ"
    tree = shapely.STRtree(found)
    for lane in read_streets(text(ASSETS, name, "net")).lanes:
        asphalt = shapely.LineString(lane.shape).buffer(0.5 * lane.width, cap_style="flat")
        assert not tree.query(asphalt, predicate="intersects").size
    one, other = tree.query(found, predicate="overlaps")
    shared = [found[a].intersection(found[b]).area for a, b in zip(one, other, strict=True)]
    assert max(shared, default=0.0) < 1.0, "corners are rounded to decimetres"


def after(name: str, scale: float | None, steps: int) -> Signals:
    """What the traffic component shows after so many steps."""
    scene = ASSETS / f"{name}.sumocfg"
    with closing(SumoTraffic(TrafficParameters(scene=scene, step_length=0.1, scale=scale))) as it:
        it.setup(0, np.random.default_rng(5))
        for k in range(steps):
            it.step({}, k * H, H)
        return dict(it.outputs())


def census(signals: Signals) -> Counter[Body]:
    return Counter(Body(code) for code in np.asarray(signals["vehicle.body"]).tolist())


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize(("scale", "vehicles"), [(0.1, 100), (None, 300), (1.0, 1000)])
def test_the_streets_are_full_after_a_second(name: str, scale: float | None, vehicles: int) -> None:
    signals = after(name, scale, 10)
    there = census(signals)
    persons = there.pop(Body.PEDESTRIAN)
    bicycles = there.pop(Body.BICYCLE)
    assert sum(there.values()) == pytest.approx(vehicles, rel=0.06)
    assert np.count_nonzero(signals["vehicle.equipped"]) == sum(there.values())
    assert persons == pytest.approx(0.2 * vehicles, rel=0.1)
    assert 0 < bicycles < 0.1 * vehicles
    assert there.keys() == set(Body) - {Body.RAIL, Body.BICYCLE, Body.PEDESTRIAN}
    speed = np.hypot(*np.asarray(signals["vehicle.velocity"]).T)
    assert np.count_nonzero(speed > 5.0) > 0.5 * vehicles
    heights = np.asarray(signals["vehicle.size"])[:, 2]
    assert heights.min() < 1.55
    assert heights.max() == 4.0


def test_without_a_scale_that_of_the_configuration_holds() -> None:
    told, silent = after("city", 0.3, 3), after("city", None, 3)
    np.testing.assert_array_equal(told["vehicle.position"], silent["vehicle.position"])


def test_nobody_departs_with_a_scale_of_nought() -> None:
    assert not np.size(after("city", 0.0, 5)["vehicle.id"])


def test_a_sumo_that_runs_already_has_a_scale_of_its_own() -> None:
    parameters = TrafficParameters(scene=ASSETS / "city.sumocfg", scale=0.5, traci="localhost:8813")
    with pytest.raises(ParameterError, match="start that one with `--scale`"):
        SumoTraffic(parameters)
