"""Bodies are told apart by geometry: by nothing else, and whichever way the scene is turned."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import Float
from fmus.messages.records import POINT, SENSOR, frame, unframe
from fmus.physics.boxes import in_boxes
from orchestrator.signal import Array
from tests.fmus.driver import Library, Refused
from tests.fmus.lidar.harness import CAR, NO_NOISE, TRUCK, Lidar
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import Outputs, Perception
from .scene import Scan, cloud

EGO: Final = 1
LABELS: Final = 2
TENTH: Final = 10**8
NORTH: Final = np.pi / 2
EYE: Final = Vehicle(id=EGO, heading=NORTH, lidar=True)


@pytest.fixture(scope="module")
def lidar(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The lidar, as built for this machine."""
    return Library.build("lidar", tmp_path_factory.mktemp("lidar"))


def car(number: int, x: float, y: float, heading: float = NORTH) -> Vehicle:
    return Vehicle(id=number, position=(x, y, 0.0), heading=heading, body=CAR)


def truck(number: int, x: float, y: float, heading: float = NORTH) -> Vehicle:
    size = (8.0, 2.5, 4.0)
    return Vehicle(id=number, position=(x, y, 0.0), heading=heading, size=size, body=TRUCK)


def scanned(lidar: Library, scene: Scene, **parameters: float) -> bytes:
    """What the sensors of a scene see."""
    eyes = Lidar(lidar, scene, **parameters).start()
    points = eyes.points()
    eyes.free()
    return points


def detect(library: Library, points: bytes, **settings: float) -> Array:
    """The objects in one scan."""
    with Perception(library, **settings) as unit:
        return unit.step(points, ego=EGO).objects


def relabelled(points: bytes, labels: str) -> bytes:
    """The same scan with other labels."""
    head = 16 + unframe("LPTS", points, SENSOR).nbytes
    records = np.frombuffer(points, POINT, -1, head).copy()
    if labels == "zero":
        records["instance"] = 0
    else:
        records["instance"] = np.random.default_rng(3).permutation(records["instance"])
    return points[:head] + records.tobytes()


def everything(outputs: Outputs) -> tuple[object, ...]:
    return (outputs.apms_signal, outputs.objects_signal, outputs.centers.tobytes(),
            outputs.ranges.tobytes(), outputs.sharers.tobytes(), outputs.benefits.tobytes(),
            outputs.trigger)  # fmt: skip


STREET: Final = Scene(
    vehicles=[EYE, car(2, 3.5, 12.0), truck(3, -3.5, 15.0), car(4, 3.0, -14.0),
              Vehicle(id=5, position=(0.0, 25.0, 0.0), lidar=True)],
    buildings=[Building(ring=rectangle(25.0, 20.0, 20.0, 30.0))],
)  # fmt: skip


@pytest.mark.parametrize("labels", ["zero", "permuted"])
def test_labels_have_no_influence_on_any_output(
    library: Library, lidar: Library, labels: str
) -> None:
    points = scanned(lidar, STREET)
    route = np.array([[0.0, 0.0], [0.0, 60.0]])
    results = []
    for signal in (points, relabelled(points, labels)):
        with Perception(library) as unit:
            own = unit.step(signal, ego=EGO, route=route)
            results.append([everything(own), everything(unit.step(signal, own.apms_signal, EGO))])
    assert results[0] == results[1]
    assert len(own.objects) >= 4, "the scene must have objects"


def test_the_ideal_detector_does_use_the_labels(library: Library, lidar: Library) -> None:
    points = scanned(lidar, STREET)
    found = [
        detect(library, signal, segmentation=LABELS)
        for signal in (points, relabelled(points, "zero"))
    ]
    assert len(found[0]) != len(found[1])


@given(seed=st.integers(0, 2**32 - 1))
def test_the_order_of_the_points_has_no_influence(
    library: Library, lidar: Library, seed: int
) -> None:
    points = scanned(lidar, STREET)
    sensors = unframe("LPTS", points, SENSOR)
    records = np.frombuffer(points, POINT, -1, 16 + sensors.nbytes).copy()
    rng = np.random.default_rng(seed)
    for sensor in sensors:
        span = slice(sensor["first"], sensor["first"] + sensor["count"])
        records[span] = rng.permutation(records[span])
    shuffled = frame("LPTS", sensors, records.tobytes())
    assert detect(library, shuffled).tobytes() == detect(library, points).tobytes()


@given(
    x=st.floats(-1e4, 1e4),
    y=st.floats(-1e4, 1e4),
    angle=st.sampled_from([np.pi / 2, -np.pi / 2, np.pi]) | st.floats(-10.0, 10.0),
)
def test_bodies_move_and_turn_with_the_scene(
    library: Library, lidar: Library, x: float, y: float, angle: float
) -> None:
    """By any angle: boxes, too."""
    points = scanned(lidar, STREET)
    cos, sin = np.cos(angle), np.sin(angle)
    sensors = unframe("LPTS", points, SENSOR).copy()
    place = sensors["position"].copy()
    sensors["position"][:, 0] = cos * place[:, 0] - sin * place[:, 1] + x
    sensors["position"][:, 1] = sin * place[:, 0] + cos * place[:, 1] + y
    sensors["heading"] += angle
    moved = frame("LPTS", sensors, points[16 + sensors.nbytes :])
    before, after = detect(library, points), detect(library, moved)
    assert before["points"].tolist() == after["points"].tolist()
    np.testing.assert_allclose(after["height"], before["height"], atol=1e-9)
    expected = before["position"] @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
    np.testing.assert_allclose(after["position"], expected, atol=1e-6)
    assert ((after["angle"] >= 0.0) & (after["angle"] < np.pi / 2)).all()
    whole, rest = np.divmod(after["angle"] - before["angle"] - angle + np.pi / 4, np.pi / 2)
    np.testing.assert_allclose(rest, np.pi / 4, atol=1e-9)
    swapped = (whole % 2 == 1)[:, None]
    sizes = np.where(swapped, after["size"][:, ::-1], after["size"])
    np.testing.assert_allclose(sizes, before["size"], atol=1e-9)


def inside(objects: Array, vehicle: Vehicle) -> int:
    """How many objects have their middle in a vehicle's body."""
    middle = objects["position"] - vehicle.position[:2]
    cos, sin = np.cos(vehicle.heading), np.sin(vehicle.heading)
    along = np.abs(middle @ (cos, sin)) <= vehicle.size[0] / 2 + 0.3
    across = np.abs(middle @ (-sin, cos)) <= vehicle.size[1] / 2 + 0.3
    return int((along & across).sum())


def found_once(
    library: Library, lidar: Library, vehicles: Sequence[Vehicle], **settings: float
) -> bool:
    """Whether each vehicle is one object, and nothing else is."""
    objects = detect(
        library,
        scanned(lidar, Scene(vehicles=[EYE, *sorted(vehicles, key=lambda v: v.id)])),
        **settings,
    )
    return len(objects) == len(vehicles) and all(inside(objects, v) == 1 for v in vehicles)


@pytest.mark.parametrize("distance", [10.0, 20.0, 30.0])
@pytest.mark.parametrize("gap", [0.7, 1.0])
def test_two_trucks_side_by_side_are_two(
    library: Library, lidar: Library, distance: float, gap: float
) -> None:
    offset = 1.25 + gap / 2
    assert found_once(library, lidar, [truck(2, -offset, distance), truck(3, offset, distance)])


@pytest.mark.parametrize("lane", [3.5, 7.0])
@pytest.mark.parametrize("gap", [1.5, 2.0, 2.5])
def test_a_queue_of_trucks_in_another_lane_is_not_one_body(
    library: Library, lidar: Library, gap: float, lane: float
) -> None:
    queue = [truck(2 + k, lane, 5.0 + k * (8.0 + gap)) for k in range(3)]
    assert found_once(library, lidar, queue)


@pytest.mark.parametrize("gap", [2.0, 2.5])
@pytest.mark.parametrize("lane", [3.2, 6.4])
def test_a_queue_of_cars_in_another_lane_is_not_one_body(
    library: Library, lidar: Library, gap: float, lane: float
) -> None:
    queue = [car(2 + k, lane, -8.0 + k * (4.5 + gap)) for k in range(4)]
    assert found_once(library, lidar, queue)


@pytest.mark.parametrize("distance", [12.0, 16.0])
@pytest.mark.parametrize("gap", [1.6, 2.0])
def test_a_car_is_not_the_bonnet_of_the_truck_before_it(
    library: Library, lidar: Library, distance: float, gap: float
) -> None:
    behind, before = car(2, 3.5, distance + 2.25), truck(3, 3.5, distance + 4.5 + gap + 4.0)
    assert found_once(library, lidar, [behind, before])


@pytest.mark.parametrize("heading", np.linspace(0, np.pi, 9))
@pytest.mark.parametrize("distance", [8.0, 15.0, 25.0, 40.0])
@pytest.mark.parametrize("kind", [car, truck])
def test_one_vehicle_is_one_body_whichever_way_it_stands(
    library: Library, lidar: Library, heading: float, distance: float, kind: object
) -> None:
    vehicle = (car if kind is car else truck)(2, 2.0, distance, heading)
    assert found_once(library, lidar, [vehicle])


def test_a_car_that_is_half_hidden_is_one_body(library: Library, lidar: Library) -> None:
    for x in (-4.0, -3.0, 3.0, 4.0):
        assert found_once(library, lidar, [truck(3, x, 10.0), car(2, 0.0, 22.0, 0.0)])


def test_a_car_behind_a_post_is_one_body(library: Library, lidar: Library) -> None:
    post = Building(ring=rectangle(0.0, 8.0, 0.15, 0.15))
    scene = Scene(vehicles=[EYE, car(2, 0.0, 14.0, 0.0)], buildings=[post])
    objects = detect(library, scanned(lidar, scene), vehicle_height=20.0)
    assert inside(objects, scene.vehicles[1]) == 1


HOUSE: Final = Building(ring=rectangle(0.0, 22.0, 40.0, 4.0), height=9.0)


def mapped(library: Library, points: bytes, *houses: Building) -> Array:
    """The objects of a vehicle with a map."""
    with Perception(library) as unit:
        unit.begin()
        corners = [corner for house in houses for corner in house.ring]
        unit.resize(n_building_vertex=len(corners))
        unit.set("building.vertex", np.array(corners))
        unit.set("building.index", np.repeat(range(len(houses)), [len(h.ring) for h in houses]))
        unit.set_inputs(points, ego=EGO)
        unit.advance()
        return unit.outputs().objects


def test_buildings_on_the_map_are_no_objects_and_a_car_before_them_is(
    library: Library, lidar: Library
) -> None:
    parked = car(2, -3.0, 18.5, 0.0)
    points = scanned(lidar, Scene(vehicles=[EYE, parked], buildings=[HOUSE]))
    objects = mapped(library, points, HOUSE)
    assert len(objects) == inside(objects, parked) == 1


def test_without_a_map_what_is_larger_than_a_vehicle_is_none(
    library: Library, lidar: Library
) -> None:
    points = scanned(lidar, Scene(vehicles=[EYE], buildings=[HOUSE]))
    assert len(detect(library, points)) == 0


def test_the_margin_of_the_map_is_a_distance_from_the_footprint(library: Library) -> None:
    line = np.linspace(-0.5, 0.5, 40)
    for distance, count in ((0.49, 0), (0.51, 1)):
        face = np.column_stack([line, np.full(40, 20.0 - distance), np.ones(40)])
        objects = mapped(library, cloud(Scan(vehicle=EGO, points=face)), HOUSE)
        assert len(objects) == count


@pytest.mark.parametrize(
    ("vertex", "index", "wrong"),
    [
        ([[0, 0], [1, np.nan], [1, 1]], [0, 0, 0], r"building\.vertex\[1, 1\] is"),
        ([[0, 0], [1, 0], [1, 1]], [0, 0, -1], r"building\.index\[2\] is -1, must be 0 or more"),
        ([[0, 0], [1, 0], [1, 1]], [1, 1, 0], r"building\.index\[2\] is 0 after 1; it must not"),
    ],
)
def test_a_map_that_makes_no_sense_is_refused(
    library: Library, vertex: list[list[float]], index: list[int], wrong: str
) -> None:
    with Perception(library) as unit:
        unit.begin()
        unit.set("building.vertex", np.array(vertex, float))
        unit.set("building.index", np.array(index))
        unit.set_inputs(b"")
        with pytest.raises(Refused, match=wrong):
            unit.advance()


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 3000), spread=st.floats(1.0, 400.0))
def test_points_anywhere_give_each_object_its_points(
    library: Library, seed: int, count: int, spread: float
) -> None:
    """No point counts twice, none is made up, and boxes hold what they count."""
    rng = np.random.default_rng(seed)
    points: Float = rng.uniform(-spread, spread, (count, 3)) * (1, 1, 0) + (0, 0, 1.0)
    objects = detect(library, cloud(Scan(vehicle=EGO, points=points)))
    assert objects["points"].sum() <= count
    for found in objects:
        local = in_boxes(points[:, None, :2], found["position"], found["angle"])[:, 0]
        in_box = (np.abs(local) <= found["size"] / 2 + 1e-3).all(axis=1)
        assert found["points"] <= in_box.sum()
        assert found["points"] >= 5


def test_track_numbers_are_never_used_again(library: Library, lidar: Library) -> None:
    seen: list[int] = []
    with Perception(library) as unit:
        for k, y in enumerate([12.0, 200.0, 12.0, 200.0, 12.0]):  # away for longer than the timeout
            points = scanned(lidar, Scene(vehicles=[EYE, car(2, 0.0, y)]), **NO_NOISE)
            sensors = unframe("LPTS", points, SENSOR).copy()
            sensors["time"] = 2 * k * 10**9
            moved = frame("LPTS", sensors, points[16 + sensors.nbytes :])
            seen += unit.step(moved, ego=EGO).objects["instance"].tolist()
    assert len(seen) == 3
    assert len(set(seen)) == 3
