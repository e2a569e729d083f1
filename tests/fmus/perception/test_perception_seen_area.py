"""The index `seen_area`: which share of each cell's ground a sensor sees."""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
import pytest

from fmus.messages.apm import Apm, Float, join
from fmus.messages.records import APM_HEADER
from tests.fmus.driver import Library
from tests.fmus.perception.harness import Outputs, Perception
from tests.fmus.perception.rays import FARTHEST, NEAREST, Wall, sweep
from tests.fmus.perception.scene import Scan, cloud

EGO, OTHER = 3, 5
LEVELS: Final = 255
SEEN_AREA: Final = 2
WHOLE: Final = 0.8
"""Least share of a cell that is seen wholly: four or more azimuths cross it, one perhaps on its
border."""
FINE: Final = {"index": SEEN_AREA, "index_levels": LEVELS, "rows": 96, "columns": 96, "cell": 1.25}
"""A matrix of 120 m x 120 m, more than the sensor's range."""
WALL: Final = Wall(ends=((20.0, -10.0), (20.0, 10.0)))
HALF_ANGLE: Final = float(np.arctan2(10.0, 20.0))
"""Of the wall as seen from the origin [rad]."""

Look = Callable[..., Outputs]


@pytest.fixture
def look(library: Library) -> Look:
    """One step over the scans, with the ego vehicle's matrix."""

    def step(*scans: Scan, received: bytes = b"", **settings: float) -> Outputs:
        perception = Perception(library, **{**FINE, **settings})
        try:
            return perception.step(cloud(*scans), received, ego=EGO)
        finally:
            perception.free()

    return step


def shares(apm: Apm) -> Float:
    """Of the ground in each cell."""
    return apm.cells / LEVELS


def corners(apm: Apm) -> Float:
    """Of each cell relative to its centre of the matrix [m], shape (rows, columns, 4, 2)."""
    row, column = np.indices(apm.cells.shape)
    index = np.stack([row, column], axis=-1)[:, :, None] + [[0, 0], [0, 1], [1, 0], [1, 1]]
    moved: Float = apm.world(index) - apm.center
    return moved


def distances(apm: Apm) -> tuple[Float, Float]:
    """The smallest and largest distance of each cell's corners from the sensor [m]."""
    distance = np.linalg.norm(corners(apm), axis=-1)
    return distance.min(axis=-1), distance.max(axis=-1)


def test_open_ground_is_seen_from_the_lowest_channel_to_the_range(look: Look) -> None:
    (apm,) = look(sweep(EGO)).apms
    low, high = distances(apm)
    assert (shares(apm)[(low > NEAREST + 0.1) & (high < FARTHEST - 0.1)] > WHOLE).all()
    assert (shares(apm)[(high < NEAREST - 0.1) | (low > FARTHEST + 0.1)] == 0).all()
    area = shares(apm).sum() * apm.cell**2
    assert area == pytest.approx(np.pi * (FARTHEST**2 - NEAREST**2), rel=0.01)


def test_ground_beyond_the_last_ring_is_seen_to_the_range(look: Look) -> None:
    """The next channel would meet it out of range, and met nothing: rings at 40.1 and 46.2 m."""
    scan = sweep(EGO)
    near = np.linalg.norm(scan.points - scan.position, axis=-1) < 44.0
    (apm,) = look(replace(scan, points=scan.points[near]), range=44.0).apms
    area = shares(apm).sum() * apm.cell**2
    assert area == pytest.approx(np.pi * (44.0**2 - 2.0**2 - NEAREST**2), rel=0.01)


def test_a_wall_hides_its_shadow_and_nothing_before_it(look: Look) -> None:
    (apm,) = look(sweep(EGO, [WALL])).apms
    at = corners(apm)
    angle = np.abs(np.arctan2(at[..., 1], at[..., 0])).max(axis=-1)
    low, _ = distances(apm)
    is_behind = (at[..., 0].min(axis=-1) > 20.0) & (angle < HALF_ANGLE - 0.01)
    is_before = (at[..., 0].max(axis=-1) < 20.0) & (low > NEAREST + 0.1) & (angle < HALF_ANGLE)
    assert is_behind.sum() > 100
    assert (shares(apm)[is_behind] == 0).all()
    assert (shares(apm)[is_before] > WHOLE).all()


def test_the_area_before_a_wall_is_that_of_the_triangle(look: Look) -> None:
    open_ground, walled = (
        shares(look(scan).apms[0]).sum() * 1.25**2 for scan in (sweep(EGO), sweep(EGO, [WALL]))
    )
    shadow = HALF_ANGLE * FARTHEST**2 - 20.0 * 10.0
    assert open_ground - walled == pytest.approx(shadow, rel=0.015)


def test_returns_from_the_foot_of_a_body_do_not_show_what_is_behind(look: Look) -> None:
    """They are lower than `ground_height`, so no object, but no ground either."""
    scan = sweep(EGO, [WALL])
    is_foot = (scan.points[:, 0] > 19.9) & (scan.points[:, 2] < 0.2)
    assert is_foot.sum() > 10
    (apm,) = look(replace(scan, points=scan.points[(scan.points[:, 0] < 19.9) | is_foot])).apms
    row, column = apm.locate(np.array([22.0, 0.0]))
    assert shares(apm)[row, column] == 0


@pytest.mark.parametrize(("pitch", "roll"), [(0.05, 0.0), (0.0, -0.05), (0.04, 0.03)])
def test_a_tilted_sensor_sees_the_same_ground(look: Look, pitch: float, roll: float) -> None:
    (apm,) = look(sweep(EGO, [WALL], pitch=pitch, roll=roll)).apms
    (level,) = look(sweep(EGO, [WALL])).apms
    low, high = distances(apm)
    both = (low > 9.0) & (high < 35.0)  # what the lowest and the highest channel reach
    assert np.abs(shares(apm) - shares(level))[both].mean() < 0.01
    assert shares(apm)[both].sum() == pytest.approx(shares(level)[both].sum(), rel=0.01)


def test_strips_are_as_wide_as_the_tilted_step_is_on_the_ground(look: Look) -> None:
    """Ahead of a sensor that looks down by 17 degrees azimuths are a tenth farther apart."""
    (apm,) = look(sweep(EGO, pitch=0.3), cell=0.5).apms
    at = corners(apm)
    low, high = distances(apm)
    is_ahead = (np.abs(at[..., 1]).max(axis=-1) < 2.0) & (at[..., 0].min(axis=-1) > 0)
    ahead = shares(apm)[is_ahead & (low > 4.0) & (high < 8.0)]
    assert len(ahead) >= 40
    assert ahead.mean() > 0.98


def test_the_nearest_of_several_returns_from_one_direction_counts(look: Look) -> None:
    walled, behind = sweep(EGO, [WALL]), sweep(EGO)
    both = replace(walled, points=np.concatenate([walled.points, behind.points]))
    assert (look(both).apms[0].cells == look(walled).apms[0].cells).all()


def test_returns_from_the_own_body_hide_nothing(look: Look) -> None:
    scan = sweep(EGO)
    angle = np.linspace(0, 2 * np.pi, 500)
    body = np.stack([0.8 * np.cos(angle), 0.8 * np.sin(angle), 0 * angle + 1.7], axis=-1)
    with_body = replace(scan, points=np.concatenate([scan.points, body]))
    assert (look(with_body).apms[0].cells == look(scan).apms[0].cells).all()


def test_an_offset_moves_the_matrix_and_not_what_is_seen(look: Look) -> None:
    cells = look(sweep(EGO, [WALL])).apms[0].cells
    moved = look(sweep(EGO, [WALL]), offset=8 * 1.25).apms[0].cells
    assert (moved[:-8] == cells[8:]).all()


@pytest.mark.parametrize("levels", [1, 3, 15])
def test_levels_are_rounded_to_the_nearest(look: Look, levels: int) -> None:
    fine = look(sweep(EGO, [WALL])).apms[0].cells / LEVELS
    coarse = look(sweep(EGO, [WALL]), index_levels=levels).apms[0].cells / levels
    assert np.abs(coarse - fine).max() <= 0.5 / levels + 0.5 / LEVELS


def test_the_order_of_points_does_not_matter(look: Look) -> None:
    scan = sweep(EGO, [WALL])
    order = np.random.default_rng(1).permutation(len(scan.points))
    shuffled = replace(scan, points=scan.points[order])
    assert (look(scan).apms[0].cells == look(shuffled).apms[0].cells).all()


def test_lost_returns_between_two_from_the_ground_hide_nothing(look: Look) -> None:
    scan = sweep(EGO)
    kept = np.random.default_rng(2).random(len(scan.points)) > 0.02
    whole = shares(look(scan).apms[0]).sum()
    assert shares(look(replace(scan, points=scan.points[kept])).apms[0]).sum() == pytest.approx(
        whole, rel=0.01
    )


@pytest.mark.parametrize("heading", [0.0, 0.7, 3.0])
def test_the_benefit_is_the_hidden_area_that_the_sharer_sees(look: Look, heading: float) -> None:
    """The zones are all hidden, the sharer behind the wall sees all of them.

    Zones are whole cells: along the 60 m of the border, 1.25 m may be given away or won.
    """
    sharer = sweep(OTHER, [WALL], origin=(32.0, 0.0), heading=heading)
    (message,) = look(sharer, window_largest=1).messages
    seen = look(
        sweep(EGO, [WALL]),
        received=join([message]),
        window_largest=1,
        n_blind_zone=4000,
        near_field=8.0,
        horizon=26.0,
        region_resolution=0.25,
    )
    hidden = HALF_ANGLE * 26.0**2 - 20.0 * 10.0
    assert seen.sharers.tolist() == [OTHER]
    assert seen.benefits[0] == pytest.approx(hidden, rel=0.1)


@pytest.mark.parametrize(("own", "other"), [(SEEN_AREA, 1), (1, SEEN_AREA)])
def test_a_matrix_with_another_index_is_not_used(library: Library, own: int, other: int) -> None:
    sender, ego = (Perception(library, **{**FINE, "index": index}) for index in (other, own))
    (message,) = sender.step(cloud(sweep(OTHER)), b"", ego=EGO).messages
    ego.begin()
    ego.set_inputs(cloud(sweep(EGO)), join([message]), EGO)
    (log,) = ego.advance()
    names = {1: "points", SEEN_AREA: "seen_area"}
    assert f"has the index `{names[other]}`, not `{names[own]}`" in log
    assert ego.outputs().sharers.size == 0
    for one in (sender, ego):
        one.free()


def test_the_message_says_how_many_levels_there_are(look: Look) -> None:
    (message,) = look(sweep(EGO), index_levels=15).messages
    assert np.frombuffer(message, APM_HEADER, 1)["flags"][0] >> 8 == 15


def test_a_sensor_on_or_under_the_ground_or_out_of_range_sees_nothing(look: Look) -> None:
    for height in (-1.0, 0.0, 60.0):
        (apm,) = look(replace(sweep(EGO), position=(0.0, 0.0, height))).apms
        assert (apm.cells == 0).all()
