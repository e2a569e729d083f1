"""The abstract perception matrix counts points; its message is what fmus/messages/apm/ says."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import encode, join, layer_height, layer_velocity
from fmus.messages.records import APM_LAYER_CELL
from orchestrator.signal import Array
from tests.fmus.driver import Library

from .harness import Perception
from .scene import Scan, car, cloud, look

VEHICLE = 3
BY_LABELS = 2
BLANKING = 1.0
"""Returns nearer than this are the own body [m]."""


def reference(scan: Scan, rows: int, columns: int, cell: float, offset: float) -> Array:
    """The index of each cell, from the points in the world frame."""
    forward = np.array([np.cos(scan.heading), np.sin(scan.heading)])
    left = np.array([-forward[1], forward[0]])
    relative = scan.points[:, :2] - scan.position[:2] - offset * forward
    row = np.floor(relative @ forward / cell + rows / 2).astype(int)
    column = np.floor(relative @ left / cell + columns / 2).astype(int)
    height = scan.points[:, 2]
    kept = (height >= -0.5) & (height <= 4.5)
    kept &= np.hypot(*(scan.points[:, :2] - scan.position[:2]).T) >= BLANKING
    kept &= (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    cells = np.zeros((rows, columns), np.uint32)
    np.add.at(cells, (row[kept], column[kept]), 1)
    return cells


@st.composite
def scans(draw: st.DrawFn) -> Scan:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    position = rng.uniform(-500, 500, 3) * (1, 1, 0) + (0, 0, 2)
    count = draw(st.integers(0, 500))
    points = position + rng.uniform((-70, -70, -3), (70, 70, 4), (count, 3))
    return Scan(
        vehicle=VEHICLE,
        points=points,
        instances=rng.integers(-3, 6, count),
        time=draw(st.integers(0, 10**12)),
        position=(position[0], position[1], 2.0),
        heading=draw(st.floats(-7, 7)),
        pitch=draw(st.floats(-0.3, 0.3)),
        roll=draw(st.floats(-0.3, 0.3)),
    )


@given(
    scan=scans(),
    rows=st.integers(1, 24),
    columns=st.integers(1, 24),
    cell=st.floats(0.5, 9),
    offset=st.floats(-20, 20),
)
def test_the_index_of_a_cell_is_its_number_of_points(
    library: Library, *, scan: Scan, rows: int, columns: int, cell: float, offset: float
) -> None:
    with Perception(library, rows=rows, columns=columns, cell=cell, offset=offset) as unit:
        (apm,) = unit.step(cloud(scan)).apms
    assert (apm.vehicle, apm.time) == (scan.vehicle, scan.time)
    assert apm.heading == scan.heading
    np.testing.assert_array_equal(apm.position, scan.position[:2])
    forward = np.array([np.cos(scan.heading), np.sin(scan.heading)])
    np.testing.assert_allclose(apm.center, apm.position + offset * forward, atol=1e-9)
    expected = reference(scan, rows, columns, cell, offset)
    # single-precision points on a border may fall to either side of it
    difference = np.abs(apm.cells.astype(int) - expected.astype(int)).sum()
    assert difference <= 2 * (len(scan.points) > 0)


def test_points_on_the_own_body_underground_and_overhead_are_pruned(library: Library) -> None:
    x = np.array([0.7, 7.0, 7.0, 7.0, 7.0])
    y = np.array([0.7, 1.0, 1.0, 1.0, 1.0])
    z = np.array([1.0, -0.6, 4.6, 4.4, 0.0])
    scan = Scan(vehicle=VEHICLE, points=np.stack([x, y, z], axis=-1))
    with Perception(library) as unit:
        (apm,) = unit.step(cloud(scan)).apms
    assert apm.cells.sum() == apm.cells[11, 10] == 2  # ground counts: it shows the cell is seen


@pytest.mark.parametrize("layer", [False, True])
@pytest.mark.parametrize(("rows", "columns"), [(20, 20), (3, 5), (1, 1)])
def test_messages_are_the_same_bytes_as_the_python_codec_writes(
    library: Library, *, rows: int, columns: int, layer: bool
) -> None:
    boxes = [car(5, 12, 3), car(6, -9, -4, height=3.2)]
    scene = cloud(look(1, (0, 0), boxes), look(2, (30, 10), boxes))
    with Perception(library, rows=rows, columns=columns, layer=layer) as unit:
        result = unit.step(scene)
    assert [encode(apm) for apm in result.apms] == result.messages
    assert join(result.messages) == result.apms_signal
    assert [apm.layer is not None for apm in result.apms] == [layer, layer]


def test_a_20_by_20_matrix_without_layer_has_1600_bytes_of_cells(library: Library) -> None:
    with Perception(library, layer=False) as unit:
        (message,) = unit.step(cloud(Scan(vehicle=0, points=np.zeros((0, 3))))).messages
    assert len(message) == 72 + 1600


def test_the_layer_shows_the_highest_object_of_each_cell(library: Library) -> None:
    low, high = car(5, 12.0, 1.0), car(6, 12.0, 3.6, height=3.2)
    scan = look(VEHICLE, (0, 0), [low, high])
    with Perception(library, ground_height=0.0) as unit:
        result = unit.step(cloud(scan))
    (apm,) = result.apms
    assert apm.layer is not None
    cells = apm.locate(scan.points[:, :2])
    for row, column in np.ndindex(apm.cells.shape):
        inside = (cells == (row, column)).all(axis=-1)
        instances = np.unique(np.asarray(scan.instances)[inside])
        expected = np.zeros((), APM_LAYER_CELL)
        if instances.size:
            tallest = max(instances)  # instance 6 is the higher one
            on_it = int((inside & (scan.instances == tallest)).sum())
            expected["height"] = {5: 30, 6: 64}[tallest]
            expected["points"] = min(on_it, 255)
        assert apm.layer[row, column] == expected, (row, column)
    assert layer_height(apm.layer).max() == pytest.approx(3.2)


def test_the_layer_carries_the_tracked_velocity(library: Library) -> None:
    with Perception(library) as unit:
        for k in range(8):
            scan = look(VEHICLE, (0, 0), [car(5, 12 - 0.8 * k, 6)], time=k * 10**8)
            result = unit.step(cloud(scan))
    (apm,) = result.apms
    assert apm.layer is not None
    seen = layer_velocity(apm.layer)[apm.layer["height"] > 0]
    assert len(seen)
    np.testing.assert_allclose(seen, [(-8.0, 0.0)] * len(seen), atol=0.26)


def test_heights_and_velocities_saturate(library: Library) -> None:
    with Perception(library, segmentation=BY_LABELS, fastest=100.0) as unit:
        for k in range(3):
            x = 10.0 + 5 * k  # 50 m/s
            points = np.column_stack([np.full(9, x), np.arange(9), np.full(9, 14.0)])
            scan = Scan(vehicle=VEHICLE, points=points, instances=5, time=k * 10**8)
            result = unit.step(cloud(scan))
    (apm,) = result.apms
    assert apm.layer is not None
    assert set(apm.layer[apm.layer["height"] > 0].tolist()) == {(255, 127, 0, 4), (255, 127, 0, 5)}
