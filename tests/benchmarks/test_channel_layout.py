"""The committed inputs, and the grid that grows."""

import csv
import gzip
import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.channel.growth import MIDDLE, TILE, grid_of
from benchmarks.channel.import_golden import import_golden
from benchmarks.channel.layout import DATA, Layout, there_and_back
from benchmarks.channel.workload import Workload, cross44, grid200
from fmus.messages.records import BSM, NO_VEHICLE, PACKET, unframe

CROSS, GRID = Layout.read(DATA / "cross44.npz"), Layout.read(DATA / "grid200.npz")
VEINS = {
    (row["scenario"], row["models"]): row
    for row in json.loads((DATA / "veins.json").read_text(encoding="utf-8"))["rows"]
}


@pytest.mark.parametrize(
    ("layout", "scenes", "vehicles", "buildings"), [(CROSS, 200, 44, 8), (GRID, 20, 200, 16)]
)
def test_the_recordings_are_whole(
    layout: Layout, scenes: int, vehicles: int, buildings: int
) -> None:
    assert (layout.scenes, layout.vehicles, layout.buildings) == (scenes, vehicles, buildings)
    moved = np.linalg.norm(np.diff(layout.front, axis=0), axis=-1)
    assert moved.max() < 3.5  # a lane's width: lane changes are made at once
    assert moved.mean() > 0.1
    assert len(np.unique(layout.size, axis=0)) == 5
    assert np.all((layout.size[:, 2] >= 1.5) & (layout.size[:, 2] <= 4.0))


@pytest.mark.parametrize("layout", [CROSS, GRID, grid_of(GRID, 300)])
def test_no_vehicle_is_inside_a_building(layout: Layout) -> None:
    for number in range(layout.buildings):
        ring = layout.vertex[layout.index == number]
        assert not is_inside(ring, layout.front.reshape(-1, 2)).any()


def is_inside(ring: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Even-odd rule."""
    inside = np.zeros(len(points), np.bool_)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crosses & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


@pytest.mark.parametrize("workload", [cross44(), grid200()])
def test_as_many_packets_as_in_veins(workload: Workload) -> None:
    """With jitter, the draws differ, and a few more or less fall into the time."""
    heard_by = workload.layout.vehicles - 1
    veins = VEINS[workload.name, "free space"]
    assert workload.duration == veins["sim_s"] * 10**9
    if workload.jitter == 0.0:
        assert workload.sent * heard_by == veins["deliveries"]
    else:
        assert workload.sent * heard_by == pytest.approx(veins["deliveries"], rel=0.005)


@pytest.mark.parametrize("workload", [cross44(), grid200()])
def test_every_vehicle_sends_ten_times_a_second(workload: Workload) -> None:
    per_step = [unframe("PKTS", each, PACKET) for each in workload.packets]
    for start, packets in zip(workload.grid, per_step, strict=True):
        assert np.all((packets["time"] >= start) & (packets["time"] < start + 100_000_000))
    packets = np.concatenate(per_step)
    assert np.array_equal(packets["id"], np.arange(len(packets)))
    assert np.all(np.diff(packets["time"]) >= 0)
    assert set(packets["size"]) == {200}
    assert set(packets["kind"]) == {BSM}
    assert set(packets["destination"]) == set(packets["route"].ravel()) == {NO_VEHICLE}
    phases = np.sort([times_of(packets, k)[0] for k in range(workload.layout.vehicles)]) / 1e9
    assert phases.min() >= 0.1
    assert phases.max() < 0.2
    assert np.abs(phases - np.linspace(0.1, 0.2, len(phases))).max() < 0.02  # Kolmogorov-Smirnov
    gaps = np.concatenate([np.diff(times_of(packets, k)) for k in range(len(phases))]) / 1e9
    assert np.abs(gaps - 0.1).max() <= workload.jitter + 1.001e-9
    assert gaps.std() == pytest.approx(workload.jitter / np.sqrt(3), rel=0.02, abs=1e-9)


def times_of(packets: np.ndarray, source: int) -> np.ndarray:
    found: np.ndarray = packets["time"][packets["source"] == source]
    return found


@pytest.mark.parametrize("workload", [cross44(), grid200()])
def test_scenes_follow_the_recording(workload: Workload) -> None:
    """As positions in Veins at 0, 0.1, 0.2, ... s; what stays is the same object."""
    scenes, layout = workload.scenes, workload.layout
    assert len(scenes) == workload.grid.count
    for k, scene in enumerate(scenes[1 : layout.scenes]):
        half_length = 0.5 * layout.size[:, 0]
        ahead = half_length * np.array([np.cos(layout.heading[k]), np.sin(layout.heading[k])])
        np.testing.assert_allclose(scene["vehicle.position"][:, :2] + ahead.T, layout.front[k])
    moving = {"vehicle.position", "vehicle.heading"}
    for name in scenes[0].keys() - moving:
        assert len({id(scene[name]) for scene in scenes}) == 1
    for before, after in itertools.pairwise(scenes[1:]):
        assert not np.array_equal(before["vehicle.position"], after["vehicle.position"])


def test_there_and_back_again() -> None:
    assert there_and_back(4, 10).tolist() == [0, 1, 2, 3, 2, 1, 0, 1, 2, 3]
    assert there_and_back(1, 3).tolist() == [0, 0, 0]
    assert there_and_back(20, 49)[-1] == 10


@pytest.mark.parametrize("count", [1, 50, 100, 200, 500, 1000])
def test_the_grid_has_so_many_vehicles_at_constant_density(count: int) -> None:
    layout = grid_of(GRID, count)
    assert layout.front.shape == (20, count, 2)
    assert layout.heading.shape == (20, count)
    assert layout.size.shape == (count, 3)
    if count > 1:
        side = 2 * np.abs(layout.front[0] - MIDDLE).max()
        assert 430e-6 < count / side**2 < 600e-6
        assert len(np.unique(layout.front[0], axis=0)) == count


def test_every_vehicle_of_the_grid_is_one_of_the_layout() -> None:
    """Moved by whole tiles, with its heading, its size and its way."""
    grown = grid_of(GRID, 400)
    for k in range(400):
        shift = grown.front[0, k] - GRID.front[0]
        (origin,) = np.flatnonzero(np.all(np.abs(shift - np.round(shift / TILE) * TILE) < 1e-6, 1))
        moved = grown.front[:, k] - GRID.front[:, origin]
        np.testing.assert_allclose(moved, np.tile(shift[origin], (20, 1)))
        assert np.array_equal(grown.heading[:, k], GRID.heading[:, origin])
        assert np.array_equal(grown.size[k], GRID.size[origin])


def test_larger_grids_contain_the_smaller_ones() -> None:
    small, large = grid_of(GRID, 50), grid_of(GRID, 300)
    places = {tuple(p) for p in np.round(large.front[0], 3)}
    assert {tuple(p) for p in np.round(small.front[0], 3)} <= places
    assert small.buildings < large.buildings


def test_buildings_of_the_grid_reach_into_its_square() -> None:
    layout = grid_of(GRID, 500)
    half = np.abs(layout.front[0] - MIDDLE).max()
    assert np.array_equal(np.unique(layout.index), np.arange(layout.buildings))
    for number in range(layout.buildings):
        ring = layout.vertex[layout.index == number] - MIDDLE
        assert np.all(ring.min(axis=0) < half)
        assert np.all(ring.max(axis=0) > -half)
    blocks = (2 * half / 150) ** 2
    assert blocks <= layout.buildings <= (np.sqrt(blocks) + 2) ** 2


def test_a_layout_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Whole millimetres and microdegrees survive; anything else is rounded."""
    GRID.write(tmp_path / "a.npz")
    again = Layout.read(tmp_path / "a.npz")
    for name in ("front", "heading", "size", "vertex", "index"):
        assert np.array_equal(getattr(again, name), getattr(GRID, name)), name
    replace(GRID, front=GRID.front + 0.0004).write(tmp_path / "b.npz")
    assert np.array_equal(Layout.read(tmp_path / "b.npz").front, GRID.front)
    assert sum(path.stat().st_size for path in DATA.iterdir()) < 400_000


def test_recordings_are_imported(tmp_path: Path) -> None:
    """Two vehicles, two times, one building; SUMO's angles are clockwise from north."""
    for run in ("cross44_obstacles", "grid200_obstacles_jitter"):
        record(tmp_path / "golden" / "stack" / run)
    (tmp_path / "golden" / "cost.json").write_text('{"rows": []}')
    import_golden(tmp_path / "golden", tmp_path / "data")
    layout = Layout.read(tmp_path / "data" / "cross44.npz")
    np.testing.assert_allclose(layout.front, np.array([[[1, 2], [3, 4]], [[1.5, 2], [3, 3.123]]]))
    np.testing.assert_allclose(np.degrees(layout.heading), [[0, -90], [0, -90]])
    np.testing.assert_allclose(layout.size, [[4.5, 1.8, 1.5], [9.5, 2.5, 3.5]])
    np.testing.assert_allclose(layout.vertex, [[0, 0], [5, 0], [5, 5]])
    assert layout.index.tolist() == [0, 0, 0]
    assert json.loads((tmp_path / "data" / "veins.json").read_text()) == {"rows": []}


def test_a_recording_with_a_vehicle_missing_is_refused(tmp_path: Path) -> None:
    record(tmp_path / "stack" / "cross44_obstacles", left_out=1)
    with pytest.raises(ValueError, match="not every vehicle is there all the time"):
        import_golden(tmp_path, tmp_path / "data")


def record(folder: Path, *, left_out: int = 0) -> None:
    folder.mkdir(parents=True)
    (folder / "vehicles.csv").write_text(
        "veh,type,length,width,height\na,car,4.5,1.8,1.5\nb,truck,9.5,2.5,3.5\n"
    )
    ring = [[0, 0], [5, 0], [5, 5]]
    (folder / "buildings.json").write_text(json.dumps({"buildings": [{"shape_sumo": ring}]}))
    rows = [
        ("0.100", "a", 1, 2, 90),
        ("0.100", "b", 3, 4, 180),
        ("0.200", "b", 3, 3.1229, 180),
        ("0.200", "a", 1.5, 2, 90),
    ]
    with gzip.open(folder / "positions.csv.gz", "wt", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("t_veins", "veh", "sumo_x", "sumo_y", "sumo_angle_deg"))
        writer.writerows(rows[: len(rows) - left_out])
