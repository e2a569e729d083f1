"""The drivable surface: lane centres are on it, buildings are not, its area is that of the plan."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.road import read_road
from adapters.sumo.scene import read_buildings
from adapters.sumo.simulation import Sumo
from adapters.traffic.surroundings import RoadSurface, strip
from orchestrator.randomness import stream
from tests.adapters.red_light import STEP, red_light

Float = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]


def inside(ring: Float, points: Float) -> Bool:
    """Whether the ring winds around the points, (n, 2)."""
    a, b = ring[None], np.roll(ring, -1, axis=0)[None]
    p = points[:, None]
    side = (b - a)[..., 0] * (p - a)[..., 1] - (b - a)[..., 1] * (p - a)[..., 0]
    up = (a[..., 1] <= p[..., 1]) & (b[..., 1] > p[..., 1]) & (side > 0)
    down = (a[..., 1] > p[..., 1]) & (b[..., 1] <= p[..., 1]) & (side < 0)
    return np.asarray(up.sum(axis=1) != down.sum(axis=1))


def on_road(road: RoadSurface, points: Float) -> Bool:
    rings = [road.vertex[road.index == k] for k in np.unique(road.index)]
    return np.asarray(np.any([inside(ring, points) for ring in rings], axis=0))


def along(line: Float, spacing: float) -> Float:
    """Points of a polyline, this far apart, without its ends."""
    station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.arange(spacing / 2, station[-1], spacing)
    return np.column_stack([np.interp(at, station, axis) for axis in line.T])


def test_the_centres_of_all_lanes_are_on_the_road_and_the_buildings_are_not(sumo: Sumo) -> None:
    road = read_road(sumo.net)
    for lane in sumo.net.lanes():
        assert on_road(road, along(sumo.net.lane_shape(lane), 1.0)).all(), lane
        for link in sumo.net.links(lane):
            crossing = along(sumo.net.lane_shape(link.via), 0.5)
            assert on_road(road, crossing).all(), link.via
    buildings = read_buildings(sumo, 10.0)
    assert not on_road(road, buildings.vertex).any()
    for k in range(len(buildings.height)):
        ring = buildings.vertex[buildings.index == k]
        edges = np.concatenate([ring, np.roll(ring, -1, axis=0)]).reshape(2, -1, 2)
        for fraction in np.linspace(0.0, 1.0, 21):
            assert not on_road(road, edges[0] + fraction * (edges[1] - edges[0])).any()


@pytest.mark.slow
def test_its_area_is_that_of_the_lanes_and_the_crossing(sumo: Sumo) -> None:
    """Arms of 211.75 m (5 lanes of 3.5 m) and 205.75 m (4 lanes), a crossing of 28.5 x 16.5 m.

    The median of the main road, 7 m wide with one left-turn lane in it, is no lane.
    """
    road = read_road(sumo.net)
    step = 0.5
    axis = np.arange(-230 + step / 2, 230, step)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    expected = 2 * 3.5 * (5 * 211.75 + 4 * 205.75) + 28.5 * 16.5
    assert on_road(road, points).sum() * step**2 == pytest.approx(expected, rel=0.002)


def test_the_outputs_are_fixed_and_ordered() -> None:
    traffic = SumoTraffic(red_light())
    traffic.setup(0, stream(0, "traffic"))
    try:
        before = traffic.outputs()
        traffic.step({"ego.command": np.zeros(3)}, 0, STEP)
        after = traffic.outputs()
    finally:
        traffic.close()
    vertex, index = np.asarray(before["road.vertex"]), np.asarray(before["road.index"])
    assert vertex.shape == (len(index), 2)
    assert (np.unique(index) == np.arange(index[-1] + 1)).all()
    assert (np.diff(index) >= 0).all()
    assert np.bincount(index).min() >= 3
    assert after["road.vertex"] is before["road.vertex"]
    assert after["road.index"] is before["road.index"]


NETWORK = """<net version="1.20">
<location netOffset="0,0" convBoundary="0,0,100,50" origBoundary="0,0,100,50" projParameter="!"/>
<edge id="street" from="a" to="b" priority="1">
  <lane id="street_0" index="0" allow="pedestrian" speed="2" length="100" width="2"
        shape="0,-4.2 100,-4.2"/>
  <lane id="street_1" index="1" disallow="pedestrian" speed="14" length="100" width="3.2"
        shape="0,-1.6 100,-1.6"/>
</edge>
<edge id="rail" from="c" to="d" priority="1">
  <lane id="rail_0" index="0" allow="rail" speed="14" length="100" shape="0,48.4 100,48.4"/>
</edge>
<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes=""
          shape="0,0 0,-5.2"/>
<junction id="b" type="dead_end" x="100" y="0" incLanes="street_0 street_1" intLanes=""
          shape="100,-5.2 100,0 110,0 110,-5.2"/>
<junction id="c" type="dead_end" x="0" y="50" incLanes="" intLanes="" shape="0,50 0,46"/>
<junction id="d" type="dead_end" x="100" y="50" incLanes="rail_0" intLanes=""
          shape="100,46 100,50 110,50 110,46"/>
</net>"""
"""A street with a pavement on its right, which ends in a square, and a railway to a station."""


def test_pavements_and_railways_are_no_road(tmp_path: Path, loaded: Callable[..., Sumo]) -> None:
    (tmp_path / "street.net.xml").write_text(NETWORK, encoding="utf-8")
    config = tmp_path / "street.sumocfg"
    config.write_text(
        '<configuration><net-file value="street.net.xml"/></configuration>', encoding="utf-8"
    )
    road = read_road(loaded(config).net)
    lane, square = (road.vertex[road.index == k] for k in (0, 1))
    np.testing.assert_allclose(lane, [(0, -3.2), (100, -3.2), (100, 0), (0, 0)], atol=1e-9)
    np.testing.assert_allclose(square, [(100, -5.2), (100, 0), (110, 0), (110, -5.2)])
    assert road.index.max() == 1


@given(
    st.lists(st.tuples(st.floats(5.0, 30.0), st.floats(-1.0, 1.0)), min_size=1, max_size=6),
    st.floats(0.5, 4.0),
)
def test_a_strip_around_a_gentle_line_is_as_wide_as_it_should(
    pieces: list[tuple[float, float]], width: float
) -> None:
    """Bends of up to 57 degrees; points just within half the width are inside, just beyond not."""
    heading = np.cumsum([turn for _, turn in pieces])
    length = np.array([piece for piece, _ in pieces])
    steps = length[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    line = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    ring = strip(line, width)
    assert len(ring) == 2 * len(line)
    middle = (line[:-1] + line[1:]) / 2
    normal = np.column_stack([-steps[:, 1], steps[:, 0]]) / length[:, None]
    for sign in (-1, 1):
        assert inside(ring, middle + 0.499 * sign * width * normal).all()
    first = middle[:1] + 0.501 * width * normal[:1]
    if len(pieces) == 1:
        assert not inside(ring, first).any()


def test_a_strip_does_not_mind_points_that_repeat() -> None:
    line = np.array([[0.0, 0.0], [0.0, 0.0], [10.0, 0.0], [10.0, 0.0]])
    expected = [[0.0, -1.0], [10.0, -1.0], [10.0, 1.0], [0.0, 1.0]]
    np.testing.assert_array_equal(strip(line, 2.0), expected)
