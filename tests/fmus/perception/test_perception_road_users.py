"""Persons, riders and trams, from the lidar to objects and APMs."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import pytest

from fmus.messages.bodies import Body
from orchestrator.signal import Array
from tests.fmus.boxes import bounds
from tests.fmus.driver import Library
from tests.fmus.lidar.harness import Lidar
from tests.fmus.scene import SIZES, Scene, Vehicle

from .harness import STEP, Outputs, Perception

EGO: Final = Vehicle(id=1, lidar=True)
ABREAST: Final = np.pi / 2
NOISE: Final = 6 * 0.02
"""Most that the lidar's range is off [m]."""
CHANNEL: Final = np.radians(24 / 63)
"""Between two channels [rad]."""


@pytest.fixture(scope="module")
def lidar(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The lidar, as built for this machine."""
    return Library.build("lidar", tmp_path_factory.mktemp("lidar"))


def road_user(body: Body, x: float, y: float, heading: float = ABREAST, number: int = 2) -> Vehicle:
    return Vehicle(
        id=number, position=(x, y, 0.0), heading=heading, size=SIZES[body], body=int(body)
    )


def perceived(
    lidar: Library, perception: Library, scenes: Sequence[Scene], **settings: float
) -> list[Outputs]:
    """What the ego perceives in scans of these scenes, with the lidar's default noise."""
    eyes, found = Lidar(lidar, scenes[0]).start(), []
    with Perception(perception, **settings) as unit:
        for k, scene in enumerate(scenes):
            if k > 0:
                eyes.set_inputs(scene)
                eyes.step((k - 1) * STEP, STEP)
            found.append(unit.step(eyes.points(), ego=EGO.id))
    eyes.free()
    return found


def extent(objects: Array) -> Array:
    """Along x and y [m], shape (object, 2)."""
    low, high = bounds(objects)
    return np.asarray(high - low)


@pytest.mark.parametrize("distance", [10.0, 15.0, 20.0, 40.0])
@pytest.mark.parametrize("body", [Body.PEDESTRIAN, Body.BICYCLE, Body.MOTORCYCLE])
def test_one_in_the_open_is_one_object_of_its_size(
    library: Library, lidar: Library, body: Body, distance: float
) -> None:
    """From any side, but for six standard deviations of the range noise."""
    length, width, height = SIZES[body]
    for bearing in np.linspace(0.13, 2 * np.pi + 0.13, 4, endpoint=False):
        x, y = distance * np.array([np.cos(bearing), np.sin(bearing)])
        for heading in bearing + np.array([0.0, np.pi / 4, ABREAST]):
            scene = Scene(vehicles=[EGO, road_user(body, x, y, heading)])
            (objects,) = (out.objects for out in perceived(lidar, library, [scene]))
            assert len(objects) == 1
            cos, sin = abs(np.cos(heading)), abs(np.sin(heading))
            box = np.array([length * cos + width * sin, length * sin + width * cos])
            assert (extent(objects)[0] <= box + 2 * NOISE).all()
            assert (np.abs(objects["position"][0] - (x, y)) <= box / 2 + NOISE).all()
            # a channel passes over the head, and the next one may be lost or pass beside it
            missed = 2 * CHANNEL * distance
            assert height - missed - NOISE <= objects["height"][0] <= height + NOISE


@pytest.mark.parametrize(("body", "speed"), [(Body.PEDESTRIAN, 1.4), (Body.BICYCLE, 4.2)])
@pytest.mark.parametrize("distance", [10.0, 20.0])
def test_who_crosses_is_tracked(
    library: Library, lidar: Library, body: Body, speed: float, distance: float
) -> None:
    steps = 20
    scenes = [
        Scene(vehicles=[EGO, road_user(body, distance, speed * STEP * (k - steps / 2))])
        for k in range(steps)
    ]
    objects = np.concatenate([out.objects for out in perceived(lidar, library, scenes)])
    assert len(objects) == steps
    assert len(set(objects["instance"].tolist())) == 1
    np.testing.assert_allclose(objects["velocity"][5:], [[0.0, speed]] * (steps - 5), atol=0.25)


@pytest.mark.parametrize("distance", [10.0, 20.0, 30.0])
@pytest.mark.parametrize(("beside", "behind"), [(0.75, None), (2.0, None), (None, 3.2)])
def test_a_person_near_a_parked_van_is_another_object(
    library: Library, lidar: Library, distance: float, beside: float | None, behind: float | None
) -> None:
    """0.75 m from its flank on; in line with it, where it is seen over the person, 3 m."""
    length, width, _ = SIZES[Body.VAN]
    depth, breadth, height = SIZES[Body.PEDESTRIAN]
    if beside is not None:
        person = road_user(Body.PEDESTRIAN, distance, -3.5 + width / 2 + beside + depth / 2)
        x = distance
    else:
        assert behind is not None
        person = road_user(Body.PEDESTRIAN, distance, -3.5)
        x = distance + breadth / 2 + behind + length / 2
    van = road_user(Body.VAN, x, -3.5, heading=0.0, number=3)
    (out,) = perceived(lidar, library, [Scene(vehicles=[EGO, person, van])])
    assert len(out.objects) == 2
    near = np.abs(out.objects["position"] - person.position[:2])
    ((box, top),) = (
        (extent(out.objects)[k], out.objects["height"][k])
        for k in np.flatnonzero((near < 0.4).all(axis=1))
    )
    assert box.max() < breadth + 2 * NOISE
    assert height - 2 * CHANNEL * distance - NOISE < top < height + NOISE


@pytest.mark.parametrize("distance", [11.0, 21.0])
def test_a_person_takes_a_cell_of_the_apm_and_its_layer(
    library: Library, lidar: Library, distance: float
) -> None:
    """Its points are added to those of the ground there; behind it the ground has fewer."""
    open_road = Scene(vehicles=[EGO])
    crossing = Scene(vehicles=[EGO, road_user(Body.PEDESTRIAN, distance, 2.5)])
    before, after = (
        perceived(lidar, library, [scene])[0].apms[0] for scene in (open_road, crossing)
    )
    column = 10 + int(2.5 // 5.0)
    row = 10 + int(distance // 5.0)
    assert after.cells[row, column] > before.cells[row, column]
    assert (after.cells[row + 1 :, column] <= before.cells[row + 1 :, column]).all()
    assert after.cells[row + 1 :, column].sum() < before.cells[row + 1 :, column].sum()
    assert after.layer is not None
    assert np.argwhere(after.layer["points"]).tolist() == [[row, column]]
    height = 0.05 * after.layer["height"][row, column]
    assert height == pytest.approx(SIZES[Body.PEDESTRIAN][2], abs=0.15)


@pytest.mark.parametrize("distance", [5.0, 10.0, 30.0])
def test_a_tram_is_an_object_where_vehicles_may_be_as_long(
    library: Library, lidar: Library, distance: float
) -> None:
    """By default the longest vehicle is a road train of 18.75 m; what is longer is structure."""
    length = SIZES[Body.RAIL][0]
    scene = Scene(vehicles=[EGO, road_user(Body.RAIL, 0.0, distance, heading=0.0)])
    assert len(perceived(lidar, library, [scene])[0].objects) == 0
    ((along, _),) = extent(perceived(lidar, library, [scene], vehicle_length=25.0)[0].objects)
    assert along == pytest.approx(length, abs=0.5)
