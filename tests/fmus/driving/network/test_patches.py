"""Images around places: of a standing world they stand still, whatever the sensor does."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.driving.network.patches import CHANNELS, INPUTS, LAGS, WINDOW, History, Patches, patches
from fmus.driving.network.scan import CELL, LAYERS, SIDE, Scan, scan_of
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from tests.fmus.driving.network.world import HEIGHT, PERIOD, box, seen_from, street

HERE = Frame(x=0.0, y=0.0, heading=0.0)
MIDDLE = WINDOW // 2
"""The place itself are the two cells before and behind it."""


def scan_at(cells: list[tuple[int, int, int]], time: int = 0, frame: Frame = HERE) -> Scan:
    """Of cells (layer, row, column)."""
    codes = sorted({layer * SIDE**2 + row * SIDE + column for layer, row, column in cells})
    return Scan(vehicle=1, time=time, frame=frame, height=HEIGHT, cells=np.array(codes, np.int32))


def image_of(found: Patches, place: int) -> Array:
    """Channel, row, column."""
    return np.asarray(found.image[place]).reshape(CHANNELS, WINDOW, WINDOW)


def random_cells(seed: int, count: int, margin: int = 0) -> list[tuple[int, int, int]]:
    rng = np.random.default_rng(seed)
    at = rng.integers(margin, SIDE - margin, (count, 2))
    return [(int(rng.integers(0, 2)), int(row), int(column)) for row, column in at]


@given(seed=st.integers(0, 10**6), count=st.integers(1, 60), reach=st.integers(0, 122))
@settings(max_examples=40, deadline=None)
def test_images_are_what_lies_around_their_places(seed: int, count: int, reach: int) -> None:
    """Newest and earlier scans from one place, by brute force; beyond the grid there is nothing."""
    now, before, long_ago = (random_cells(seed + k, count, reach) for k in range(3))
    found = patches([scan_at(now), scan_at(before), scan_at(long_ago)])
    blocks = {(row // 2, column // 2) for _, row, column in now}
    side = 2 * CELL
    expected = [((row + 0.5) * side - 51.2, (column + 0.5) * side - 51.2) for row, column in blocks]
    np.testing.assert_allclose(np.stack([found.x, found.y], axis=1), sorted(expected), atol=1e-9)
    for place in range(len(found.x)):
        row, column = (round((v + 51.2) / side - 0.5) * 2 for v in (found.x[place], found.y[place]))
        image = np.zeros((CHANNELS, WINDOW, WINDOW))
        layers = [(layer, r, c) for layer, r, c in now]
        layers += [(2, r, c) for _, r, c in before] + [(3, r, c) for _, r, c in long_ago]
        for channel, r, c in layers:
            at = r - row + MIDDLE - 1, c - column + MIDDLE - 1
            if min(at) >= 0 and max(at) < WINDOW:
                image[channel][at] = 1.0
        assert (image_of(found, place) == image).all()
        is_high = any(
            layer == 1 and (r // 2, c // 2) == (row // 2, column // 2) for layer, r, c in now
        )
        assert found.z[place] == (2.8 if is_high else 1.0)


def test_sizes() -> None:
    found = patches([scan_at(random_cells(1, 30))])
    assert found.image.shape == (len(found.x), INPUTS)
    assert found.image.dtype == np.float32
    assert len(patches([scan_at([])]).x) == 0
    with pytest.raises(ValueError, match="the newest scan is missing"):
        patches([None, scan_at([])])


@pytest.mark.parametrize("heading", [0.0, 0.5 * math.pi, 0.7])
def test_a_wall_stands_still_while_the_sensor_drives(heading: float) -> None:
    """12 m/s along and towards it: in all channels it is where it is, to a cell."""
    wall = np.stack([np.arange(-20, 20, 0.05), np.full(800, 9.1), np.full(800, 1.0)], axis=1)
    history = History()
    for k in range(4):
        way = 1.2 * k
        position = (way * math.cos(0.3), way * math.sin(0.3))
        history.add(scan_of(seen_from(position, heading, wall, time=k * PERIOD)))
    found = patches(history.stack)
    inner = np.flatnonzero(np.hypot(found.x, found.y) < 12.0)
    assert len(inner) > 10
    distance = [normal_offset(found, place, heading) for place in inner.tolist()]
    assert np.abs(distance).max() <= CELL * math.sqrt(2.0)


def normal_offset(found: Patches, place: int, heading: float) -> list[float]:
    """By how much the wall has moved in the channels of the past, across itself [m]."""
    normal = np.array([math.sin(heading), math.cos(heading)])  # ahead, left
    centers = []
    for channel in (0, 2, 3):
        cells = np.argwhere(image_of(found, place)[channel] > 0)
        assert len(cells) > 0
        centers.append(float((cells.mean(axis=0) * CELL) @ normal))
    return [centers[1] - centers[0], centers[2] - centers[0]]


@pytest.mark.parametrize("speed", [-8.0, 4.0, 8.0])
def test_a_vehicle_that_drives_is_further_back_in_the_past(speed: float) -> None:
    """By its speed times the lag, while the sensor drives another way."""
    history = History()
    for k in range(4):
        time = 0.1 * k
        world = box((8.0, 6.0 + speed * time), (1.6, 1.6))
        history.add(scan_of(seen_from((5.0 * time, 0.0), 0.2, world, time=k * PERIOD)))
    found = patches(history.stack)
    at = int(np.argmin(np.hypot(found.x - found.x.mean(), found.y - found.y.mean())))
    image = image_of(found, at)
    left = np.array([math.sin(0.2), math.cos(0.2)])  # world's y in the sensor's frame
    now = (np.argwhere(image[0] > 0).mean(axis=0) * CELL) @ left
    for channel, lag in zip((2, 3), LAGS, strict=True):
        seen = np.argwhere(image[channel] > 0)
        if len(seen) and seen.min() > 0 and seen.max() < WINDOW - 1:  # all of it is in the image
            moved = now - (seen.mean(axis=0) * CELL) @ left
            assert moved == pytest.approx(speed * lag / 1e9, abs=CELL)
        else:
            assert abs(speed * lag / 1e9) > 1.0


@given(x=st.floats(-30, 30), y=st.floats(-30, 30), heading=st.floats(-3, 3))
@settings(max_examples=15, deadline=None)
def test_images_do_not_depend_on_where_the_world_is(x: float, y: float, heading: float) -> None:
    """Scans from one place and heading: the frames cancel exactly, wherever that is."""
    shifted = Frame(x=x, y=y, heading=heading)
    cells = [random_cells(k, 50) for k in range(3)]
    one = patches([scan_at(each) for each in cells])
    other = patches([scan_at(each, frame=shifted) for each in cells])
    assert one.image.tobytes() == other.image.tobytes()
    assert one.x.tobytes() == other.x.tobytes()


def test_scans_of_others_are_laid_over_the_own_ones() -> None:
    """What one sees, and another elsewhere, is together what one sees of both."""
    left, right = box((8.0, 4.0)), box((10.0, -4.0))
    both = scan_of(seen_from((0.0, 0.0), 0.0, np.concatenate([left, right])))
    own = scan_of(seen_from((0.0, 0.0), 0.0, left))
    other = scan_of(seen_from((20.0, -20.0), math.pi / 2, right, vehicle=2))
    expected, found = patches([both]), patches([own], [[other]])
    assert abs(len(found.x) - len(expected.x)) <= 0.2 * len(expected.x)
    assert len(found.x) > len(patches([own]).x)
    places = set(zip(expected.x.tolist(), expected.y.tolist(), strict=True))
    # a cell of the other is one cell of ours, seen from a right angle; at most its neighbour
    for x, y in zip(found.x.tolist(), found.y.tolist(), strict=True):
        assert min(math.hypot(x - a, y - b) for a, b in places) <= 2 * CELL * math.sqrt(2.0)


def test_no_other_is_as_none() -> None:
    scan = scan_of(seen_from((0.0, 0.0), 0.0, street()))
    alone = patches([scan])
    for others in ([], [()], [[None, None, None]]):
        found = patches([scan], others)
        assert found.image.tobytes() == alone.image.tobytes()


def test_history_gives_the_scans_of_its_lags() -> None:
    history = History()
    assert list(history.stack) == []
    for k in range(8):
        history.add(scan_at([], time=k * PERIOD))
        times = [None if scan is None else scan.time // PERIOD for scan in history.stack]
        assert times == [k, k - 1 if k >= 1 else None, k - 3 if k >= 3 else None]


def test_a_scan_that_is_missing_leaves_its_channels_empty() -> None:
    history = History()
    for k in (0, 1, 3, 4):
        history.add(scan_at([(LAYERS.index(0.3), 100, 100)], time=k * PERIOD))
    assert [scan is None for scan in history.stack] == [False, False, False]
    history.add(scan_at([(0, 100, 100)], time=5 * PERIOD))
    assert [scan is None for scan in history.stack] == [False, False, True]
    (image,) = patches(history.stack).image.reshape(1, CHANNELS, -1)
    assert image.sum(axis=1).tolist() == [1.0, 0.0, 1.0, 0.0]


def test_a_scan_again_replaces_itself_and_an_older_one_begins_anew() -> None:
    history = History()
    for k in (0, 1, 1):
        history.add(scan_at([(0, 100, 100 + k)], time=k * PERIOD))
    assert [scan is None for scan in history.stack] == [False, False, True]
    history.add(scan_at([], time=0))
    assert [scan is None for scan in history.stack] == [False, True, True]
