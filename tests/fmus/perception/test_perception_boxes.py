"""Boxes of objects are turned as the faces of the bodies are: by geometry alone."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fmus.messages.bodies import Body
from fmus.messages.records import POINT, SENSOR, frame, unframe
from fmus.physics.boxes import corners, in_boxes
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.lidar.harness import BUS, CAR, SUV, TRUCK, VAN, Lidar
from tests.fmus.scene import Scene, Vehicle

from .harness import Perception
from .scene import Scan, cloud
from .test_perception_truth import KINDS, clouds, crossroads

CLUSTERS, LABELS = 1, 2  # values of `segmentation`
FITTED, ALONG_AXES = 1, 2  # values of `boxes`
NOISE = 0.02
"""Standard deviation of a lidar's ranges [m], the default."""
EYE = Vehicle(id=1, position=(0.0, 0.0, 0.0), heading=0.4, size=KINDS[CAR], body=CAR, lidar=True)


def street(seed: int) -> Scene:
    """Five bodies around a sensor, none behind another, with any headings, 9 to 45 m away."""
    rng = np.random.default_rng(seed)
    bearings = (np.arange(5) + rng.uniform(0.0, 0.8, 5)) * 2 * np.pi / 5
    bodies: list[Body] = rng.permutation([CAR, SUV, VAN, BUS, TRUCK]).tolist()
    others = [
        Vehicle(
            id=2 + k,
            position=(float(r * np.cos(b)), float(r * np.sin(b)), 0.0),
            heading=float(rng.uniform(-np.pi, np.pi)),
            size=KINDS[Body(body)],
            body=body,
        )
        for k, (b, r, body) in enumerate(
            zip(bearings, rng.uniform(9.0, 45.0, 5), bodies, strict=True)
        )
    ]
    return Scene(vehicles=[EYE, *others])


@pytest.fixture(scope="module")
def lidar(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library.build("lidar", tmp_path_factory.mktemp("lidar"))


def scanned(lidar: Library, scene: Scene) -> bytes:
    eyes = Lidar(lidar, scene).start()
    points = eyes.points()
    eyes.free()
    return points


def detect(library: Library, points: bytes, **settings: float) -> Array:
    with Perception(library, **settings) as unit:
        return unit.step(points).objects.copy()


@dataclass(frozen=True, slots=True)
class Found:
    """An object and the vehicle that it is."""

    box: Array
    body: Vehicle

    @property
    def turned(self) -> float:
        """The angle between their sides [rad], -pi/4 to pi/4."""
        between = float(self.box["angle"]) - self.body.heading
        return (between + np.pi / 4) % (np.pi / 2) - np.pi / 4

    @property
    def beyond(self) -> float:
        """How far the box sticks out of the body [m]; negative if it does not."""
        ends = corners(self.box["position"], self.box["angle"], self.box["size"])
        place = np.array([self.body.position[:2]])
        local = in_boxes(ends[:, None], place, np.array([self.body.heading]))[:, 0]
        return float((np.abs(local) - np.array(self.body.size[:2]) / 2).max())


def all_found(lidar: Library, library: Library, **settings: float) -> Iterator[Found]:
    for seed in range(20):
        scene = street(seed)
        for box in detect(library, scanned(lidar, scene), **settings):
            away = [np.hypot(*(box["position"] - v.position[:2])) for v in scene.vehicles[1:]]
            yield Found(box, scene.vehicles[1 + int(np.argmin(away))])


@pytest.mark.parametrize("segmentation", [CLUSTERS, LABELS], ids=["clusters", "labels"])
def test_a_box_is_turned_as_its_body_is(
    lidar: Library, library: Library, segmentation: int
) -> None:
    """So it sticks out by no more than the noise of some hundred points."""
    found = list(all_found(lidar, library, segmentation=segmentation))
    assert len(found) >= 99  # a bus may stand before somebody
    errors = np.degrees([abs(one.turned) for one in found])
    assert np.median(errors) < 0.2
    assert errors.max() < 2.0
    assert max(one.beyond for one in found) < 8 * NOISE


def test_along_the_axes_a_box_sticks_out_of_a_body_that_is_not(
    lidar: Library, library: Library
) -> None:
    """A half of |l sin 2t| at most: what fitting is for."""
    found = list(all_found(lidar, library, boxes=ALONG_AXES))
    assert {float(one.box["angle"]) for one in found} == {0.0}
    assert np.median([one.beyond for one in found]) > 0.3


@pytest.mark.parametrize("segmentation", [CLUSTERS, LABELS])
def test_only_boxes_depend_on_the_choice(
    lidar: Library, library: Library, segmentation: int
) -> None:
    points = scanned(lidar, street(3))
    fitted, straight = (
        detect(library, points, segmentation=segmentation, boxes=each)
        for each in (FITTED, ALONG_AXES)
    )
    for name in ("sensor", "time", "instance", "points", "height", "velocity"):
        np.testing.assert_array_equal(fitted[name], straight[name])
    assert (fitted["size"].prod(axis=1) <= straight["size"].prod(axis=1) + 1e-6).all()


def test_the_order_of_labelled_points_has_no_influence(lidar: Library, library: Library) -> None:
    points = scanned(lidar, street(5))
    (sensor,) = unframe("LPTS", points, SENSOR)
    records = np.frombuffer(points, POINT, -1, 16 + SENSOR.itemsize)
    shuffled = np.random.default_rng(1).permutation(records)
    again = frame("LPTS", np.array([sensor], SENSOR), shuffled.tobytes())
    before, after = (detect(library, each, segmentation=LABELS) for each in (points, again))
    assert before.tobytes() == after.tobytes()


def tracked(library: Library, scans: list[bytes], turn: float, shift: Array) -> list[Array]:
    """The objects in scans of a scene that is turned about the world's origin, and shifted."""
    cos, sin = np.cos(turn), np.sin(turn)
    found = []
    with Perception(library) as unit:
        for points in scans:
            sensors = unframe("LPTS", points, SENSOR).copy()
            place = sensors["position"][:, :2] @ np.array([[cos, sin], [-sin, cos]])
            sensors["position"][:, :2] = place + shift
            sensors["heading"] += turn
            found.append(unit.step(frame("LPTS", sensors, points[16 + sensors.nbytes :])).objects)
    return found


@pytest.fixture(scope="module")
def scans(lidar: Library) -> list[bytes]:
    """A second and a half at the crossroads."""
    return clouds(lidar, crossroads())[:15]


@pytest.mark.parametrize("turn", [0.2, np.pi / 4, 1.4, np.pi / 2, -2.0, 3.5])
def test_tracks_move_and_turn_with_the_scene(
    library: Library, scans: list[bytes], turn: float
) -> None:
    """Numbers, velocities and boxes: what is tracked does not depend on the world's axes."""
    cos, sin = np.cos(turn), np.sin(turn)
    matrix, shift = np.array([[cos, sin], [-sin, cos]]), np.array([300.0, -80.0])
    for before, after in zip(
        tracked(library, scans, 0.0, np.zeros(2)), tracked(library, scans, turn, shift), strict=True
    ):
        assert after["instance"].tolist() == before["instance"].tolist()
        assert after["points"].tolist() == before["points"].tolist()
        np.testing.assert_allclose(after["velocity"], before["velocity"] @ matrix, atol=1e-6)
        np.testing.assert_allclose(
            after["position"], before["position"] @ matrix + shift, atol=1e-6
        )
        np.testing.assert_allclose(after["size"].prod(axis=1), before["size"].prod(axis=1))


@pytest.mark.parametrize("segmentation", [CLUSTERS, LABELS])
def test_the_box_of_a_body_that_turns_turns_with_it(
    lidar: Library, library: Library, segmentation: int
) -> None:
    """A bus by 20 degrees a second, which is within 2 degrees of its box in every scan."""
    errors, tracks = [], set()
    with Perception(library, segmentation=segmentation) as unit:
        for k in range(30):
            heading = 0.3 + np.radians(2.0 * k)
            bus = Vehicle(
                id=9, position=(20.0, 6.0, 0.0), heading=heading, size=KINDS[BUS], body=BUS
            )
            points = scanned(lidar, Scene(vehicles=[EYE, bus]))
            sensors = unframe("LPTS", points, SENSOR).copy()
            sensors["time"] = k * 10**8
            (one,) = unit.step(frame("LPTS", sensors, points[16 + sensors.nbytes :])).objects
            errors.append(abs(Found(one, bus).turned))
            tracks.add(int(one["instance"]))
    assert len(tracks) == 1
    assert np.degrees(max(errors)) < 2.0


@pytest.mark.parametrize("rate", [0.35, -0.35])
@pytest.mark.parametrize("body", [CAR, VAN])
def test_a_vehicle_that_turns_moves_as_it_drives(
    lidar: Library, library: Library, body: Body, rate: float
) -> None:
    """On a circle of 8 m by 20 degrees a second, but for the lag of the filter."""
    center, radius, errors = np.array([18.0, 6.0]), 8.0, []
    with Perception(library) as unit:
        for k in range(40):
            angle = 2.0 + rate * 0.1 * k
            outwards = np.array([np.cos(angle), np.sin(angle)])
            velocity = radius * rate * np.array([-outwards[1], outwards[0]])
            vehicle = Vehicle(
                id=9,
                position=(*(center + radius * outwards), 0.0),
                heading=float(np.arctan2(velocity[1], velocity[0])),
                size=KINDS[body],
                body=body,
            )
            points = scanned(lidar, Scene(vehicles=[EYE, vehicle]))
            sensors = unframe("LPTS", points, SENSOR).copy()
            sensors["time"] = k * 10**8
            (one,) = unit.step(frame("LPTS", sensors, points[16 + sensors.nbytes :])).objects
            errors.append(np.linalg.norm(one["velocity"] - velocity))
    lag = 0.25 * radius * rate**2  # of the filter [m/s], docs/physics-perception.md
    assert np.median(errors[8:]) == pytest.approx(lag, abs=0.1)
    assert np.percentile(errors[8:], 95) < 2.5 * lag


@pytest.mark.parametrize("count", [40, 4000])
@pytest.mark.parametrize("heading", [-2.0, 0.0, 0.7, 3.0])
def test_a_box_is_the_smallest_of_its_angle_around_all_points(
    library: Library, count: int, heading: float
) -> None:
    """Also of those that had no say in its angle."""
    rng = np.random.default_rng(count)
    local = np.zeros((count, 3))
    local[:, 0], local[:, 2] = rng.uniform(-2.2, 2.2, count), 1.0
    local[: count // 3, 0], local[: count // 3, 1] = -2.2, -rng.uniform(0.0, 1.7, count // 3)
    cos, sin = np.cos(0.5), np.sin(0.5)
    points = local @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + (9.0, 4.0, 0.0)
    scan = replace(Scan(vehicle=1, points=points), instances=7)
    signal = cloud(scan)
    sensors = unframe("LPTS", signal, SENSOR).copy()
    sensors["heading"] = heading  # turns the cloud, too
    signal = frame("LPTS", sensors, signal[16 + sensors.nbytes :])
    (box,) = detect(library, signal, segmentation=LABELS)
    assert box["points"] == count
    assert (float(box["angle"]) - 0.5 - heading + 0.1) % (np.pi / 2) == pytest.approx(0.1, abs=0.01)
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    world = points[:, :2] @ turn
    seen = in_boxes(world[:, None], box["position"], box["angle"])[:, 0]
    np.testing.assert_allclose(seen.max(axis=0), box["size"] / 2, atol=1e-5)
    np.testing.assert_allclose(seen.min(axis=0), -box["size"] / 2, atol=1e-5)


@pytest.mark.parametrize("angle", [0.1, 0.6, 1.4])
def test_a_body_of_the_fewest_points_has_a_box_that_is_turned(
    library: Library, angle: float
) -> None:
    """Five points in a line of 1.6 m: a box along them, and as good as no width."""
    along = np.linspace(-0.8, 0.8, 5)[:, None] * [np.cos(angle), np.sin(angle)]
    points = np.column_stack([along + np.array([12.0, -3.0]), np.full(5, 1.0)])
    signal = cloud(Scan(vehicle=1, points=points, instances=7))
    (box,) = detect(library, signal, segmentation=LABELS)
    assert box["points"] == 5
    assert box["angle"] == pytest.approx(angle, abs=0.001)
    np.testing.assert_allclose(box["size"], [1.6, 0.0], atol=0.002)
