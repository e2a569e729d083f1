"""Facts of the red-light scene: what hides what from whom, and when."""

import logging
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from adapters.sumo import SumoTraffic
from adapters.sumo.ego import stopping_distance
from adapters.sumo.errors import SumoError
from adapters.sumo.headless import with_stand_ins
from adapters.sumo.scene import VehicleTypes, positive, read_buildings
from adapters.sumo.simulation import Sumo
from adapters.traffic.bodies import Body
from adapters.traffic.geometry import Boxes
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from tests.adapters.red_light import ASSETS, SCENE, ego_speed, entity, red_light
from tests.adapters.sight import cut

PARAMETERS = red_light()
SPEED = ego_speed(PARAMETERS)
DYNAMICS = entity(PARAMETERS, "ego").dynamics.single_track
TRUCKS = entity(PARAMETERS, "blocking").count
EGO, COLLIDER, SHARER, FIRST_TRUCK = range(4)  # numbers in the order of entry
CONFLICT = np.array([7.0, -5.25])

Float = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def start() -> Signals:
    """The outputs at the first communication point."""
    traffic = SumoTraffic(PARAMETERS)
    traffic.setup(0, stream(0, "traffic"))
    outputs = traffic.outputs()
    traffic.close()
    return outputs


def array(signals: Signals, name: str) -> Float:
    return np.asarray(signals[name])


def footprint(signals: Signals, row: int) -> Float:
    """Corners of a vehicle's body, (4, 2)."""
    return Boxes(
        center=array(signals, "vehicle.position")[row, :2],
        heading=array(signals, "vehicle.heading")[row],
        size=array(signals, "vehicle.size")[row, :2],
    ).corners()


def trucks(signals: Signals) -> list[Float]:
    return [footprint(signals, FIRST_TRUCK + k) for k in range(TRUCKS)]


def buildings(signals: Signals) -> list[Float]:
    vertex, index = array(signals, "building.vertex"), array(signals, "building.index")
    return [vertex[index == k] for k in range(len(array(signals, "building.height")))]


def test_the_main_road_has_five_lanes_and_the_side_road_four(sumo: Sumo) -> None:
    lanes = sumo.net.lanes()
    for arm, count in {"south": 5, "north": 5, "west": 4, "east": 4}.items():
        assert sum(lane.startswith(f"{arm}_") for lane in lanes) == count
    assert {sumo.net.lane_width(lane) for lane in lanes} == {3.5}
    assert {round(sumo.net.speed_limit(lane) * 3.6) for lane in lanes} == {50}
    assert min(sumo.net.lane_length(lane) for lane in lanes) >= 200.0


def test_traffic_keeps_to_the_right_and_lanes_of_the_main_road_run_straight_on(
    sumo: Sumo,
) -> None:
    net = sumo.net
    assert net.lane_shape("south_in_1")[0, 0] == net.lane_shape("north_out_1")[0, 0] == 7.0
    assert net.lane_shape("north_in_1")[0, 0] == net.lane_shape("south_out_1")[0, 0] == -7.0


def test_the_lights_show_what_the_encounter_needs_for_forty_seconds(sumo: Sumo) -> None:
    import libsumo  # noqa: PLC0415  (only this test looks at the lights)

    signal: dict[str, set[str]] = {}
    for _ in range(round(40.0 / 0.05)):
        state = libsumo.trafficlight.getRedYellowGreenState("center")
        links = libsumo.trafficlight.getControlledLinks("center")
        for letter, ((from_lane, to_lane, _),) in zip(state, links, strict=True):
            signal.setdefault(f"{from_lane}>{to_lane}", set()).add(letter.upper())
        sumo.step()
    for way in ("south_in_0>north_out_0", "south_in_1>north_out_1", "north_in_1>south_out_1"):
        assert signal[way] == {"G"}
    for way in ("south_in_2>west_out_1", "north_in_2>east_out_1"):
        assert signal[way] == {"R"}
    for way, letters in signal.items():
        assert not way.startswith(("west_in", "east_in")) or letters == {"R"}


def test_vehicle_types_are_plausible(sumo: Sumo) -> None:
    types = VehicleTypes(sumo, 0.05).declared()
    assert {kind.body for kind in types} == {Body.CAR, Body.SUV, Body.VAN, Body.BUS, Body.TRUCK}
    for kind in types:
        length, width, height = kind.size
        assert 3.5 <= length <= 12.0, kind
        assert 1.6 <= width <= 2.55, kind
        assert 0.0 <= kind.antenna_height - height <= 0.101, kind
    cars = [kind for kind in types if kind.body is Body.CAR]
    assert all(1.5 <= kind.antenna_height <= 1.8 for kind in cars)
    assert max(kind.size[2] for kind in types) == 4.0
    assert sum(kind.share for kind in types) == pytest.approx(1.0)


def test_buildings_keep_their_distance_from_the_kerb(start: Signals) -> None:
    for ring in buildings(start):
        beside_main = np.abs(ring[:, 0]).min() - 12.25
        beside_side = np.abs(ring[:, 1]).min() - 7.0
        assert len({(x > 0, y > 0) for x, y in ring}) == 1, "inside one block"
        assert min(beside_main, beside_side) >= 4.0
        assert min(beside_main, beside_side) <= 8.0, "in the first row"


def test_every_block_has_a_building_that_is_not_convex(start: Signals) -> None:
    heights = array(start, "building.height")
    assert ((heights >= 12.0) & (heights <= 30.0)).all()
    blocks = set()
    for ring in buildings(start):
        edge = np.roll(ring, -1, axis=0) - ring
        following = np.roll(edge, -1, axis=0)
        turn = edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0]
        if (turn > 0).any() and (turn < 0).any():
            blocks.add(tuple(ring.mean(axis=0) > 0))
    assert len(blocks) == 4


def test_the_direct_link_is_free_at_first_and_crosses_up_to_three_trucks_later(
    start: Signals,
) -> None:
    """The table of docs/physics-traffic.md: from here on [m], this many trucks are in the link."""
    y = np.arange(-145.7, 7.0, 0.05)
    ego = np.stack([np.full_like(y, 7.0), y], axis=1)
    sharer = np.broadcast_to(array(start, "vehicle.position")[SHARER, :2], ego.shape)
    count = np.sum([cut(ego, sharer, truck) for truck in trucks(start)], axis=0)
    changes = np.flatnonzero(np.diff(count)) + 1
    assert count[0] == 0
    found = [(float(y[k]), int(count[k])) for k in changes]
    expected = [(-92.6, 1), (-75.3, 2), (-57.9, 3), (-50.8, 2), (-40.6, 3)]
    expected += [(-38.8, 2), (-26.7, 1), (-14.6, 0)]
    assert [trucks_in_it for _, trucks_in_it in found] == [number for _, number in expected]
    for (at, _), (documented, _) in zip(found, expected, strict=True):
        assert at == pytest.approx(documented, abs=0.1)
    assert not any(cut(ego, sharer, ring).any() for ring in buildings(start))


def first_sight(start: Signals, collider_speed: float) -> float:
    """Distance [m] from the ego's front to the collider's swept path when it first sees it.

    Both keep their speeds and meet at the conflict point. The ego's sensor, above the centre of
    its roof, is lower than trucks and buildings. Within the 50 m of the lidar.
    """
    way = np.arange(100.0, 0.0, -0.02)  # of the ego to the conflict point
    sensor = CONFLICT - np.stack([np.zeros_like(way), way], axis=1)
    collider = CONFLICT - np.stack([way * collider_speed / SPEED, 0 * way], axis=1)
    length, width, _ = array(start, "vehicle.size")[COLLIDER]
    visible = np.zeros(len(way), dtype=bool)
    for along in np.linspace(-0.5, 0.5, 5):
        for across in (-0.5, 0.5):
            target = collider + np.array([along * length, across * width])
            obstacles = trucks(start) + buildings(start)
            hidden = np.any([cut(sensor, target, obstacle) for obstacle in obstacles], axis=0)
            near = np.hypot(*(target - sensor).T) <= 50.0
            visible |= ~hidden & near
    ego_length = array(start, "ego.size")[0]
    return float(way[np.argmax(visible)] - 0.5 * ego_length - 0.5 * width)


@pytest.mark.parametrize(
    ("speed", "documented"),
    [(25.0, 4.9), (27.5, 4.4), (30.0, 4.1), (32.5, 3.7), (35.0, 3.5), (40.0, 3.0)],
)
def test_the_ego_sees_the_collider_too_late(
    start: Signals, speed: float, documented: float
) -> None:
    """With the actuator's lag of 0.1 s as its only reaction time, it cannot stop any more."""
    remaining = first_sight(start, speed / 3.6)
    assert remaining == pytest.approx(documented, abs=0.06)
    assert remaining < stopping_distance(SPEED, DYNAMICS)


def test_the_ego_would_see_it_in_time_without_the_trucks(start: Signals) -> None:
    """The trucks are what makes it too late: without them only the buildings hide it."""
    alone = dict(start)
    far_away = array(start, "vehicle.position").copy()
    far_away[FIRST_TRUCK : FIRST_TRUCK + TRUCKS, 0] = 300.0
    alone["vehicle.position"] = far_away
    assert first_sight(alone, 30 / 3.6) > 3.0 * stopping_distance(30 / 3.6, DYNAMICS)


def test_the_sharing_node_sees_the_collider_for_the_last_forty_metres(start: Signals) -> None:
    x = np.arange(CONFLICT[0] - 57.0, CONFLICT[0], 0.1)
    width = array(start, "vehicle.size")[COLLIDER, 1]
    side = np.stack([x, np.full_like(x, CONFLICT[1] + 0.5 * width)], axis=1)
    sharer = np.broadcast_to(array(start, "vehicle.position")[SHARER, :2], side.shape)
    for obstacle in trucks(start) + buildings(start):
        assert not cut(sharer, side, obstacle).any()
    assert np.hypot(*(side - sharer).T).max() < 50.0


def test_the_net_is_what_netconvert_makes_of_its_sources(tmp_path: Path) -> None:
    beside_python = Path(sys.executable).with_name("netconvert")
    netconvert = beside_python if beside_python.exists() else shutil.which("netconvert")
    if netconvert is None:
        pytest.skip("netconvert is not installed (pip install nlosim[net])")
    for source in ASSETS.iterdir():
        shutil.copy(source, tmp_path)
    environment = with_stand_ins(os.environ)
    command = [netconvert, "-c", "red_light.netccfg"]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, timeout=60)
    made = (tmp_path / "red_light.net.xml").read_text(encoding="utf-8")
    made = re.sub(r"^<!-- generated.*?^-->\n", "", made, flags=re.DOTALL | re.MULTILINE)
    assert made == (ASSETS / "red_light.net.xml").read_text(encoding="utf-8")


def with_file(tmp_path: Path, name: str, old: str, new: str) -> Path:
    """A copy of the scene with one replacement in one of its files."""
    for source in ASSETS.iterdir():
        shutil.copy(source, tmp_path)
    text = (tmp_path / name).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new), encoding="utf-8")
    return tmp_path / SCENE.name


@dataclass(frozen=True)
class Defect:
    file: str
    old: str
    new: str
    message: str


@pytest.mark.parametrize(
    "defect",
    [
        Defect(
            "red_light.typ.xml",
            '<param key="antenna_height" value="4.00"/>',
            '<param key="antenna_height" value="-4.00"/>',
            "vehicle type `box_truck`: `antenna_height` must be a positive number in a `<param>`, "
            "got `-4.00`",
        ),
        Defect(
            "red_light.typ.xml",
            'value="bus"',
            'value="coach"',
            "vehicle type `bus`: `body` must be one of car, suv, van, bus, truck, rail, "
            "motorcycle, bicycle, pedestrian, got `coach`",
        ),
    ],
    ids=["antenna", "body"],
)
def test_a_defect_of_the_scene_is_named(
    tmp_path: Path, loaded: Callable[..., Sumo], defect: Defect
) -> None:
    simulation = loaded(with_file(tmp_path, defect.file, defect.old, defect.new))
    with pytest.raises(SumoError, match=re.escape(defect.message)):
        VehicleTypes(simulation, 0.05).declared()


@pytest.mark.parametrize("written", ["0", "-0.0", "inf", "nan", "high", ""])
def test_what_is_no_positive_number_is_a_problem(written: str) -> None:
    problems: list[str] = []
    positive(written, "`share`", problems)
    assert problems == [f"`share` must be a positive number in a `<param>`, got `{written}`"]


@pytest.mark.parametrize("written", ["5e-324", " 2.5 ", "1e300"])
def test_any_positive_number_is_none(written: str) -> None:
    problems: list[str] = []
    assert positive(written, "`share`", problems) == float(written)
    assert problems == []


def test_a_height_that_is_no_number_is_said_and_the_usual_one_holds(
    tmp_path: Path, loaded: Callable[..., Sumo], caplog: pytest.LogCaptureFixture
) -> None:
    old, new = 'key="height" value="24"', 'key="height" value="high"'
    simulation = loaded(with_file(tmp_path, "red_light.poly.xml", old, new))
    with caplog.at_level(logging.INFO):
        assert 7.5 in read_buildings(simulation, 7.5).height
    assert "building `sw_corner` has no height [m]: `high`, the default holds" in caplog.messages


def test_what_the_scene_does_not_say_is_as_the_parameters_say(
    tmp_path: Path, loaded: Callable[..., Sumo]
) -> None:
    """Antennas stand over the roof of 4 m; buildings without a height have the usual one."""
    antenna = '<param key="antenna_height" value="4.00"/>'
    scene = with_file(tmp_path, "red_light.typ.xml", antenna, "")
    polygons = tmp_path / "red_light.poly.xml"
    text = polygons.read_text(encoding="utf-8")
    polygons.write_text(text.replace('<param key="height" value="24"/>', ""), encoding="utf-8")
    simulation = loaded(scene)
    assert VehicleTypes(simulation, 0.07)["box_truck"].antenna_height == 4.07
    assert 7.5 in read_buildings(simulation, 7.5).height
