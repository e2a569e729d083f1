"""Objects are where their points are, and move as their sides do."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fmus.messages.records import BUILDING, GROUND
from orchestrator.signal import Array
from tests.fmus.boxes import bounds
from tests.fmus.driver import Library, Refused

from .harness import Perception
from .scene import SENSOR_HEIGHT, Box, Scan, car, cloud, look

EGO = 1
CLUSTERS, LABELS = 1, 2  # values of `segmentation`
FITTED, ALONG_AXES = 1, 2  # values of `boxes`
PERIOD = 0.1  # of the scans [s]
Scenery = Callable[[float], list[Box]]


def where(objects: Array, box: Box) -> Array:
    """The objects whose middle is in or at a box."""
    middle = objects["position"]
    inside = (middle >= np.array(box.low) - 0.3) & (middle <= np.array(box.high) + 0.3)
    found: Array = objects[inside.all(axis=1)]
    return found


def extents(objects: Array) -> Array:
    """Along the axes [m], shape (..., 2)."""
    low, high = bounds(objects)
    return np.asarray(high - low)


def track(
    library: Library,
    scenery: Scenery,
    instance: int,
    scans: int,
    *,
    sensor: Callable[[float], tuple[float, float]] = lambda _: (0.0, 0.0),
    noise: float = 0.0,
) -> Array:
    """The objects at the box called `instance` in the given number of scans, at most one each."""
    rng = np.random.default_rng(4)
    found = []
    with Perception(library) as unit:
        for k in range(scans):
            t = k * PERIOD
            scan = look(EGO, sensor(t), scenery(t), time=round(t * 1e9))
            scan.points[:] += noise * rng.standard_normal(scan.points.shape)
            (box,) = (box for box in scenery(t) if box.instance == instance)
            found.append(where(unit.step(cloud(scan)).objects, box))
            assert len(found[-1]) <= 1, "the body must not be split"
    tracked = np.concatenate(found)
    assert len(set(tracked["instance"].tolist())) == 1, "it must keep its track"
    return tracked


@pytest.mark.parametrize("segmentation", [CLUSTERS, LABELS])
def test_an_object_is_the_box_around_its_points_above_the_ground(
    library: Library, segmentation: int
) -> None:
    boxes = [car(8, 30, 4), car(7, 10, -9, height=2.6)]
    scan = look(EGO, (20.0, -3.0), boxes, time=5)
    with Perception(library, segmentation=segmentation, boxes=ALONG_AXES) as unit:
        objects = unit.step(cloud(scan)).objects
    assert objects["sensor"].tolist() == [EGO, EGO]
    assert objects["time"].tolist() == [5, 5]
    assert objects["instance"][0] < objects["instance"][1]
    for box in boxes:
        (found,) = where(objects, box)
        points = scan.points[scan.instances == box.instance]
        points = points[points[:, 2] > 0.2]
        assert found["points"] == len(points)
        low, high = bounds(found)
        np.testing.assert_allclose(low, points[:, :2].min(axis=0), atol=1e-5)
        np.testing.assert_allclose(high, points[:, :2].max(axis=0), atol=1e-5)
        assert found["angle"] == 0.0
        assert found["height"] == pytest.approx(points[:, 2].max(), abs=1e-5)
        assert found["velocity"].tolist() == [0, 0]


def test_an_ideal_detector_gives_the_labels_as_track_numbers(library: Library) -> None:
    scan = look(EGO, (20.0, -3.0), [car(8, 30, 4), car(7, 10, -9, height=2.6)], time=5)
    with Perception(library, segmentation=LABELS) as unit:
        assert unit.step(cloud(scan)).objects["instance"].tolist() == [7, 8]


def test_ground_the_own_body_and_few_points_are_no_objects(library: Library) -> None:
    line = np.linspace(-0.2, 0.2, 6)
    face = np.array([[5.0, y, z] for y in line for z in (0.1, 0.15, 1.0)])
    body = face * (0.18, 1, 1)  # 0.9 m from the sensor
    for points, minimum, objects in ((face, 6, [6]), (face, 7, []), (body, 1, [])):
        with Perception(library, minimum_points=minimum) as unit:
            found = unit.step(cloud(Scan(vehicle=EGO, points=points))).objects
        assert found["points"].tolist() == objects


def test_labels_of_ground_and_buildings_are_no_objects_of_the_ideal_detector(
    library: Library,
) -> None:
    points = np.array([[x, 5.0, z] for x in range(6) for z in (0.1, 0.15, 1.0)])
    with Perception(library, segmentation=LABELS) as unit:
        for label, count in ((GROUND, 0), (BUILDING - 1, 0), (4, 1)):
            scan = Scan(vehicle=EGO, points=points, instances=label)
            assert len(unit.step(cloud(scan)).objects) == count


@pytest.mark.parametrize("velocity", [(10.0, 0.0), (-10.0, 0.0), (0.0, 10.0), (6.0, -8.0)])
@pytest.mark.parametrize("start", [(15.0, 12.0), (-22.0, 14.0), (10.0, -25.0)])
def test_a_car_in_the_open_is_tracked_within_half_a_second(
    library: Library, velocity: tuple[float, float], start: tuple[float, float]
) -> None:
    def scenery(t: float) -> list[Box]:
        return [car(5, start[0] + velocity[0] * t, start[1] + velocity[1] * t)]

    found = track(library, scenery, 5, 6, noise=0.01)
    assert found["velocity"][0].tolist() == [0, 0]
    np.testing.assert_allclose(found["velocity"][-1], velocity, atol=0.5)


def test_without_noise_two_scans_are_enough(library: Library) -> None:
    found = track(library, lambda t: [car(5, 12 - 10 * t, 6)], 5, 3)
    np.testing.assert_allclose(found["velocity"][1], [-10, 0], atol=0.3)


def test_a_part_that_is_lost_is_no_motion_once_the_velocity_is_known(library: Library) -> None:
    """From the fourth scan on, which finds three: its front is 1.2 m farther back at once."""

    def scenery(t: float) -> list[Box]:
        front = 14 - 10 * t
        return [Box(instance=5, low=(front + 1.2 * (t > 0.25), 5.0), high=(front + 4.5, 6.8))]

    found = track(library, scenery, 5, 8)
    front = bounds(found)[0][:, 0]
    assert front[3] - front[2] == pytest.approx(0.2, abs=0.1)
    np.testing.assert_allclose(found["velocity"][1:], [(-10, 0)] * 7, atol=0.5)


def test_a_car_that_is_elsewhere_again_and_again_does_move_so(library: Library) -> None:
    """It is pushed back: 1.5 m from where it is expected in each scan, which no brake explains."""

    def scenery(t: float) -> list[Box]:
        return [car(5, 14 - 10 * t if t < 0.65 else 8 + 5 * (t - 0.6), 6)]

    found = track(library, scenery, 5, 24)
    np.testing.assert_allclose(found["velocity"][2:7], [(-10, 0)] * 5, atol=0.3)
    np.testing.assert_allclose(found["velocity"][7], (-10, 0), atol=0.3)  # not at once
    np.testing.assert_allclose(found["velocity"][-1], (5, 0), atol=0.5)


@pytest.mark.parametrize("large", [0, 1], ids=["large first", "small first"])
def test_of_two_parts_of_a_body_the_one_of_its_size_keeps_the_track(
    library: Library, large: int
) -> None:
    """A bus of 12 m, of which a sign post hides all but the first 8 m and the last 2 m."""
    cut = ((-6.0, 2.0), (4.0, 6.0)) if large == 0 else ((-6.0, -4.0), (-2.0, 6.0))
    whole = Box(instance=5, low=(-6.0, 8.0), high=(6.0, 10.5), height=3.2)
    parts = [Box(instance=5, low=(a, 8.0), high=(b, 10.5), height=3.2) for a, b in cut]
    with Perception(library) as unit:
        for k in range(4):
            (bus,) = unit.step(cloud(look(EGO, (0, 0), [whole], time=k * 10**8))).objects
        found = unit.step(cloud(look(EGO, (0, 0), parts, time=4 * 10**8))).objects
    lengths = extents(found)[:, 0]
    assert sorted(np.round(lengths).tolist()) == [2.0, 8.0]
    assert found["instance"][lengths > 5].tolist() == [bus["instance"]]


def test_a_moving_sensor_does_not_move_what_stands(library: Library) -> None:
    found = track(
        library, lambda _: [car(5, 25, 5)], 5, 20, sensor=lambda t: (9.0 * t, 0.0), noise=0.01
    )
    assert np.abs(found["velocity"][5:]).max() < 0.5


WALL = Box(instance=BUILDING, low=(8.0, 4.0), high=(9.0, 30.0), height=8.0)
"""Stands between the sensor and the road on its far side."""


def test_a_car_that_emerges_from_behind_a_wall_has_its_speed(library: Library) -> None:
    def scenery(t: float) -> list[Box]:  # towards -y, out of the shadow of the wall
        y = 22 - 10 * t
        return [WALL, Box(instance=5, low=(18, y - 2.25), high=(19.8, y + 2.25))]

    found = track(library, scenery, 5, 20)
    emerging = found[extents(found)[:, 1] < 4.0]
    assert len(emerging) >= 3, "the scene must show the car while it is partly hidden"
    for record in emerging[2:]:
        assert record["velocity"][1] == pytest.approx(-10, abs=0.5)
    assert np.abs(found["velocity"][2:] - (0, -10)).max() < 1.0


def test_a_car_that_enters_a_shadow_does_not_stop(library: Library) -> None:
    def scenery(t: float) -> list[Box]:
        y = -2 + 10 * t
        return [WALL, Box(instance=5, low=(18, y - 2.25), high=(19.8, y + 2.25))]

    found = track(library, scenery, 5, 16)
    hiding = found[extents(found)[:, 1] < 4.0]
    assert len(hiding) >= 3
    np.testing.assert_allclose(hiding["velocity"], [(0, 10)] * len(hiding), atol=0.6)


def test_a_parked_car_does_not_move_when_a_bus_uncovers_it(library: Library) -> None:
    def scenery(t: float) -> list[Box]:
        bus = Box(instance=9, low=(-6 + 8 * t, 5.0), high=(6 + 8 * t, 7.5), height=3.2)
        return [bus, car(5, 2.0, 14.0)]

    found = track(library, scenery, 5, 20)
    assert len(found) < 20, "the bus must hide the car at first"
    width = extents(found)[:, 0]
    assert width[0] < 3, "and uncover it slowly"
    assert width[-1] > 4.4
    assert np.abs(found["velocity"]).max() < 0.3


def test_rings_that_end_on_the_roof_do_not_slow_a_car_down(library: Library) -> None:
    # the sensor's rings cross the roof at fixed distances, so the rear end of the points stands
    # still until the next ring reaches the roof; the front is a face and moves with the car
    rings = np.array([14.0, 17.0, 21.0, 26.0, 33.0])
    side = np.linspace(-0.9, 0.9, 25)
    for speed in (-10.0, 10.0):
        with Perception(library, roof_gap=4.5) as unit:
            for k in range(6):
                front = 17.5 + speed * k * PERIOD
                ring = rings[(rings > front) & (rings < front + 4.5)]
                x = np.concatenate([np.full(3, front), ring])
                z = np.concatenate([[0.4, 0.8, 1.2], np.full(len(ring), 1.5)])
                points = np.array([(a, y, b) for a, b in zip(x, z, strict=True) for y in side])
                scan = Scan(vehicle=EGO, points=points, instances=5, time=k * 10**8)
                (found,) = unit.step(cloud(scan)).objects
        assert found["velocity"] == pytest.approx([speed, 0], abs=0.5)


def test_a_low_obstacle_hides_nothing_of_a_high_one(library: Library) -> None:
    # a row of parked cars in front of a passing bus, which is seen above them
    def points(t: float) -> Scan:
        parked = look(EGO, (0, 0), [car(6, 0, 6, length=60)])
        bus = look(EGO, (0, 0), [Box(instance=5, low=(9 * t - 3, 9), high=(9 * t + 9, 11.5),
                                     height=3.4)])  # fmt: skip
        visible = bus.points[:, 2] > 1.0
        return Scan(
            vehicle=EGO,
            points=np.concatenate([parked.points, bus.points[visible]]),
            instances=np.concatenate(
                [np.asarray(parked.instances), np.asarray(bus.instances)[visible]]
            ),
            time=round(t * 1e9),
        )

    with Perception(library) as unit:
        for k in range(8):
            objects = unit.step(cloud(points(k * PERIOD))).objects
    (bus,) = objects[objects["height"] > 3]
    assert bus["velocity"] == pytest.approx([9, 0], abs=0.5)


@pytest.mark.parametrize(("gap", "is_known"), [(0.9, True), (1.0, True), (1.1, False)])
def test_a_track_is_forgotten_after_a_second(
    library: Library, *, gap: float, is_known: bool
) -> None:
    times = [0.0, 0.1, 0.2, 0.2 + gap]
    with Perception(library) as unit:
        for t in times:
            scan = look(EGO, (0, 0), [car(5, 12 - 10 * t, 6)], time=round(t * 1e9))
            (found,) = unit.step(cloud(scan)).objects
    assert found["velocity"] == pytest.approx([-10, 0] if is_known else [0, 0], abs=0.3)


def test_sensors_track_on_their_own(library: Library) -> None:
    with Perception(library) as unit:
        for k in range(5):
            boxes = [car(5, 12 - k, 6)]
            scans = [look(s, (s * 2.0, 0), boxes, time=k * 10**8) for s in (1, 2) if k >= 3 * s - 3]
            objects = unit.step(cloud(*scans)).objects
    assert objects["sensor"].tolist() == [1, 2]
    assert objects["velocity"][0] == pytest.approx([-10, 0], abs=0.3)
    assert objects["velocity"][1] == pytest.approx([-10, 0], abs=0.5)


def test_the_same_scan_again_changes_nothing(library: Library) -> None:
    with Perception(library) as unit:
        for k in range(4):
            signal = cloud(look(EGO, (0, 0), [car(5, 12 - k, 6)], time=k * 10**8))
            once = unit.step(signal)
            assert unit.step(signal).objects_signal == once.objects_signal
    assert once.objects["velocity"][0] == pytest.approx([-10, 0], abs=0.3)


def test_a_low_car_that_passes_before_a_parked_one_does_not_move_it(library: Library) -> None:
    # it hides the bonnet and the boot of the parked car one after the other, never its roof
    roof, deck = (np.linspace(-r, r, 60) for r in (1.0, 2.25))
    parked = np.concatenate(
        [np.column_stack([x, np.full_like(x, 8.0), np.full_like(x, z)])
         for x, z in ((roof, 1.5), (deck, 0.5), (deck, 0.8))]
    )  # fmt: skip
    widths, velocities = [], []
    with Perception(library) as unit:
        for k in range(20):
            passing = car(6, -8 + 0.8 * k, 4.9, length=2.5, height=1.2)
            scan = look(EGO, (0.0, 0.0), [passing], time=k * 10**8)
            at_it = parked[:, :2] * 5.8 / 8  # where the line of sight leaves its roof
            below = SENSOR_HEIGHT + (parked[:, 2] - SENSOR_HEIGHT) * 5.8 / 8 < passing.height
            hidden = (np.abs(at_it[:, 0] - (-8 + 0.8 * k)) < 1.25) & below
            points = np.concatenate([scan.points, parked[~hidden]])
            labels = np.concatenate([scan.instances, np.full((~hidden).sum(), 5)])
            both = Scan(vehicle=EGO, points=points, instances=labels, time=scan.time)
            objects = unit.step(cloud(both)).objects
            (found,) = objects[bounds(objects)[1][:, 1] > 7.9]
            widths.append(extents(found)[0])
            velocities.append(found["velocity"])
    assert min(widths) < 3.7, "it must be partly hidden for a time"
    assert max(widths) > 4.4
    assert np.abs(velocities).max() < 0.1


def test_a_scan_older_than_the_last_is_refused(library: Library) -> None:
    with Perception(library) as unit:
        unit.step(cloud(look(EGO, (0, 0), [car(5, 12, 6)], time=200)))
        with pytest.raises(Refused, match=r"scan of vehicle 1 at 100 ns is older than its last"):
            unit.step(cloud(look(EGO, (0, 0), [car(5, 12, 6)], time=100)))


TRUCK = Box(instance=5, low=(-4.0, 12.0), high=(4.0, 14.4), height=2.6)
PILLARS = [
    Box(instance=8, low=(-6.0, 6.0), high=(-1.95, 6.2), height=2.6),
    Box(instance=9, low=(1.95, 6.0), high=(6.0, 6.2), height=2.6),
]
"""What stands before both ends of the truck, and beyond them."""


def moved(box: Box, x: float) -> Box:
    """The box, so far along x."""
    return replace(box, low=(box.low[0] + x, box.low[1]), high=(box.high[0] + x, box.high[1]))


def velocities(
    library: Library, sceneries: list[list[Box]], boxes: int, spin: float
) -> list[float]:
    """The velocity along x of the one object at the truck, scan by scan.

    The sensor turns by `spin` from scan to scan [rad].
    """
    found = []
    with Perception(library, boxes=boxes) as unit:
        for k, scenery in enumerate(sceneries):
            scan = replace(look(EGO, (0.0, 0.0), scenery, time=k * 10**8), heading=k * spin)
            (one,) = where(unit.step(cloud(scan)).objects, scenery[-1])
            found.append(float(one["velocity"][0]))
    return found


@pytest.mark.parametrize("spin", [0.0, 1.0])
@pytest.mark.parametrize("jump", [0.4, -0.4, 0.9])
def test_what_stands_loses_a_velocity_that_nothing_confirms(
    library: Library, jump: float, spin: float
) -> None:
    """Two scans gave it one, as of a part that comes into sight; then both ends are hidden."""
    scans = [[moved(TRUCK, -jump)], [TRUCK], *[[*PILLARS, TRUCK]] * 15]
    before, after = (velocities(library, scans, boxes, spin) for boxes in (ALONG_AXES, FITTED))
    assert before[1:] == [pytest.approx(jump / PERIOD, abs=0.5)] * 16  # it is believed for ever
    assert after[1] == before[1]
    stands = np.abs(after) < 1e-9
    assert stands[-1]
    assert abs(jump) * np.flatnonzero(stands)[1] < 4.0  # [m] that it would have driven


@pytest.mark.parametrize("spin", [0.0, 1.0])
def test_what_moves_keeps_its_velocity_while_its_ends_are_hidden(
    library: Library, spin: float
) -> None:
    """By what drives beside it."""
    ways = np.arange(16) * 0.5
    scans = [[moved(TRUCK, way)] for way in ways[:2]]
    scans += [[*[moved(each, way / 2) for each in PILLARS], moved(TRUCK, way)] for way in ways[2:]]
    found = velocities(library, scans, FITTED, spin)
    np.testing.assert_allclose(found[1:], [5.0] * 15, atol=0.5)


def hides(ways: Array, first: int) -> list[list[Box]]:
    """The truck at so many places along x; its ends are hidden from that scan on."""
    shades = [[moved(each, way / 2) for each in PILLARS] for way in ways]
    return [
        [*(shades[k] if k >= first else []), moved(TRUCK, float(way))] for k, way in enumerate(ways)
    ]


@pytest.mark.parametrize(("before", "after"), [(4.0, 8.0), (8.0, 5.0), (-4.0, -8.0), (-8.0, -5.0)])
def test_what_moves_does_not_come_to_stand_because_it_moves_otherwise(
    library: Library, before: float, after: float
) -> None:
    """Two scans gave it a velocity; then it drives faster or slower, and nobody sees its ends."""
    ways = np.cumsum([0.0, *[before * PERIOD], *[after * PERIOD] * 8])
    found = velocities(library, hides(ways, 2), FITTED, 0.0)
    np.testing.assert_allclose(found[1:], [before] * 9, atol=0.5)


@pytest.mark.parametrize("spin", [1.0, np.pi / 2, 2.5, np.pi])
def test_a_sensor_that_turns_sees_the_same_velocities(library: Library, spin: float) -> None:
    """Of what drives for five scans, and is hidden when it stops; it takes scans to doubt that."""
    ways = np.minimum(np.arange(20), 4) * 0.5
    still, turning = (velocities(library, hides(ways, 5), FITTED, each) for each in (0.0, spin))
    np.testing.assert_allclose(turning, still, atol=0.05)
    assert abs(still[4] - 5.0) < 0.2
    assert np.flatnonzero(np.abs(still) < 1e-9)[1] == 10


def wall(start: tuple[float, float], end: tuple[float, float]) -> Array:
    """Points of an upright surface from one place to the other, shape (point, 3)."""
    part = np.linspace(0.0, 1.0, 40)[:, None]
    line = np.array(start) + part * (np.array(end) - start)
    return np.concatenate([np.column_stack([line, np.full(40, z)]) for z in (0.3, 0.6, 1.0)])


def test_a_box_whose_angle_was_wrong_did_not_move(library: Library) -> None:
    """A part of a car that stands looks askew; then both its faces are seen."""
    askew = wall((10.0, -0.9), (11.2, 0.3))
    faces = np.concatenate([wall((10.0, -0.9), (10.0, 0.9)), wall((10.0, 0.9), (14.4, 0.9))])
    found = []
    with Perception(library) as unit:
        for k, points in enumerate([askew, faces, faces, faces]):
            (one,) = unit.step(cloud(Scan(vehicle=EGO, points=points, time=k * 10**8))).objects
            found.append((int(one["instance"]), np.degrees(one["angle"]), *one["velocity"]))
    assert found[0][1] == pytest.approx(45.0, abs=0.2)
    for number, angle, *velocity in found[1:]:
        assert number == found[0][0]
        assert angle == pytest.approx(0.0, abs=0.2)
        np.testing.assert_allclose(velocity, [0.0, 0.0], atol=1e-9)


def test_what_does_not_turn_has_one_angle_in_spite_of_the_noise(library: Library) -> None:
    rng, angles = np.random.default_rng(2), []
    with Perception(library) as unit:
        for k in range(30):
            scan = look(EGO, (0.0, 0.0), [car(5, 12.0, 6.0)], time=k * 10**8)
            scan.points[:] += 0.02 * rng.standard_normal(scan.points.shape)
            (one,) = unit.step(cloud(scan)).objects
            angles.append((float(one["angle"]) + 0.1) % (np.pi / 2) - 0.1)
    assert len(set(np.round(angles, 9))) <= 2
    assert abs(angles[-1]) < np.radians(1.5)


def box(center: tuple[float, float], angle: float, size: tuple[float, float]) -> Array:
    """Points of an upright box whose first side is at that angle, shape (point, 3)."""
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * size @ axes + center
    return np.concatenate([wall(corners[k - 1], corners[k]) for k in range(4)])


def angles(library: Library, scans: list[list[Array]], segmentation: int) -> list[list[float]]:
    """Those of the objects in every scan, by how far east they are [degrees]."""
    found = []
    with Perception(library, segmentation=segmentation) as unit:
        for k, bodies in enumerate(scans):
            labels = np.repeat(2 + np.arange(len(bodies)), [len(body) for body in bodies])
            scan = Scan(
                vehicle=EGO, points=np.concatenate(bodies), instances=labels, time=k * 10**8
            )
            objects = unit.step(cloud(scan)).objects
            assert len(objects) == len(bodies)
            order = np.argsort(objects["position"][:, 0])
            found.append(np.degrees(objects["angle"][order]).round(6).tolist())
    return found


SMALL = (0.9, 0.6)
"""Sides of a body that has no clear direction [m]."""


@pytest.mark.parametrize("segmentation", [CLUSTERS, LABELS])
def test_a_small_body_keeps_the_angle_that_it_had_first(
    library: Library, segmentation: int
) -> None:
    """Each its own, also of two that stand side by side; a large one takes what fits."""
    first = [box((8.0, 3.0), 0.4, SMALL), box((10.1, 3.0), 1.0, SMALL)]
    then = [box((8.0, 3.0), 0.9, SMALL), box((10.1, 3.0), 0.2, SMALL)]
    large = [box((14.0, -6.0), angle, (4.5, 1.8)) for angle in (0.3, 0.9)]
    scans = [[*first, large[0]], [*then, large[1]], [*then, large[1]]]
    before, *after = angles(library, scans, segmentation)
    assert before == pytest.approx(np.degrees([0.4, 1.0, 0.3]), abs=2.0)
    for each in after:
        assert each[:2] == before[:2]
        assert each[2] == pytest.approx(np.degrees(0.9), abs=0.2)


def test_a_body_beyond_the_gate_has_an_angle_of_its_own(library: Library) -> None:
    first, far = box((8.0, 3.0), 0.4, SMALL), box((13.0, 3.0), 1.0, SMALL)
    _, (near, found) = angles(library, [[first], [first, far]], CLUSTERS)
    assert near == pytest.approx(np.degrees(0.4), abs=2.0)
    assert found == pytest.approx(np.degrees(1.0), abs=2.0)


@pytest.mark.parametrize("heading", [0.3, -0.7, 2.1])
def test_what_comes_apart_from_a_body_has_its_velocity(library: Library, heading: float) -> None:
    """A part inside the box of a truck that drives in any direction, itself of another angle."""
    ahead = np.array([np.cos(heading), np.sin(heading)])
    velocity = 9.0 * ahead
    with Perception(library, segmentation=LABELS) as unit:
        for k in range(6):
            middle = 15.0 * np.array([-ahead[1], ahead[0]]) + velocity * PERIOD * k
            truck = box(tuple(middle), heading, (10.0, 3.0))
            part = box(tuple(middle + 3.0 * ahead), heading + 0.5, (1.0, 0.5))
            scan = Scan(
                vehicle=EGO,
                points=np.concatenate([truck, part] if k == 5 else [truck]),
                instances=np.repeat([2, 3], [len(truck), len(part) if k == 5 else 0]),
                time=k * 10**8,
            )
            found = unit.step(cloud(scan)).objects
    np.testing.assert_allclose(found["velocity"], [velocity, velocity], atol=0.2)


@pytest.mark.parametrize(("boxes", "speed"), [(FITTED, 8.0), (ALONG_AXES, 0.0)])
def test_a_face_is_in_sight_though_a_shadow_lies_on_its_edge(
    library: Library, boxes: int, speed: float
) -> None:
    """Of a car that comes past a van, whose shadow hides its flank and 0.15 m of its front."""
    found = []
    with Perception(library, boxes=boxes) as unit:
        for k in range(8):
            front = 27.0 - 8.0 * PERIOD * k
            one = Box(instance=5, low=(front, 3.0), high=(front + 4.5, 4.8))
            van = Box(instance=6, low=(10.0, -2.0), high=(10.2, 31.5 / front), height=2.6)
            scan = look(EGO, (0.0, 0.0), [van, one], time=k * 10**8)
            objects = unit.step(cloud(scan)).objects
            (seen,) = objects[objects["position"][:, 0] > 15.0]
            found.append(seen["velocity"])
    np.testing.assert_allclose(found[-1], [-speed, 0.0], atol=0.4)


def test_what_a_pillar_hid_while_the_angle_was_found_is_no_motion(library: Library) -> None:
    """A part looks askew; then one end of a truck is hidden; then its whole rear is seen."""
    truck = Box(instance=5, low=(10.0, -1.6), high=(18.0, 1.6), height=2.6)
    pillar = Box(instance=6, low=(5.0, 0.65), high=(5.1, 3.0), height=2.6)
    scans = [
        Scan(vehicle=EGO, points=wall((10.0, -1.6), (11.2, -0.4))),
        look(EGO, (0.0, 0.0), [pillar, truck], time=10**8),
        look(EGO, (0.0, 0.0), [truck], time=2 * 10**8),
    ]
    widths, velocity = [], np.zeros(2)
    with Perception(library) as unit:
        for scan in scans:
            objects = unit.step(cloud(scan)).objects
            (one,) = objects[objects["position"][:, 0] > 8.0]
            widths.append(float(one["size"].max()))
            velocity = one["velocity"]
    assert 2.5 < widths[1] < widths[2] - 0.2
    np.testing.assert_allclose(velocity, [0.0, 0.0], atol=0.1)
