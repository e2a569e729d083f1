"""What is read of a scan depends on the points and the seed, not on the points' order."""

import itertools

import numpy as np
import pytest
import torch
from hypothesis import given, strategies as st
from torch import Tensor

from fmus.driving.point_transformer.cloud import Crop, resample, thin

from .clouds import cloud, shuffled

CROP = Crop()


def voxel(point: Tensor, crop: Crop) -> tuple[int, ...]:
    corner = torch.tensor([-crop.half_width, -crop.half_width, crop.bottom])
    return tuple(((point - corner) / crop.voxel).floor().int().tolist())


def off_centre(point: Tensor, crop: Crop) -> float:
    """Distance from the centre of the point's voxel, in voxels."""
    corner = torch.tensor([-crop.half_width, -crop.half_width, crop.bottom])
    return float(((point - corner) / crop.voxel).remainder(1.0).sub(0.5).square().sum())


@pytest.mark.parametrize("crop", [CROP, Crop(half_width=20.0, bottom=-2.0, top=-1.0, voxel=4.0)])
def test_of_each_voxel_the_point_nearest_to_its_centre_stays(crop: Crop) -> None:
    given = cloud(5000)[0]
    low = torch.tensor([-crop.half_width, -crop.half_width, crop.bottom])
    high = torch.tensor([crop.half_width, crop.half_width, crop.top])
    expected: dict[tuple[int, ...], Tensor] = {}
    for point in given[((given >= low) & (given <= high)).all(1)]:
        best = expected.setdefault(voxel(point, crop), point)
        if off_centre(point, crop) < off_centre(best, crop):
            expected[voxel(point, crop)] = point
    found = thin(given, crop)
    assert {voxel(p, crop): p.tolist() for p in found} == {
        v: p.tolist() for v, p in expected.items()
    }
    assert len(found) == len(expected) >= 100


def test_the_order_of_the_points_does_not_matter_even_among_equally_near_ones() -> None:
    # the eight corners of a cube around the centre of a voxel are equally near to it
    corners = torch.tensor(list(itertools.product([0.125, 0.375], repeat=3)))
    grid = torch.tensor([[4.0, -3.0, -1.5], [4.0, -2.5, -1.5], [-7.0, 0.0, -1.0]])
    points = (grid[:, None] + corners).reshape(-1, 3)
    found = thin(points, CROP)
    assert found.tolist() == (grid[[2, 0, 1]] + 0.125).tolist()
    for seed in range(5):
        assert torch.equal(thin(shuffled(points, seed=seed)[0], CROP), found)


@given(st.integers(0, 2**32 - 1))
def test_thinning_twice_changes_nothing_and_repeated_points_do_not_count(seed: int) -> None:
    points = cloud(300, seed=seed)[0]
    once = thin(points, CROP)
    assert torch.equal(thin(once, CROP), once)
    assert torch.equal(thin(torch.cat([points, points[:50]]), CROP), once)


def test_the_limits_of_the_crop_belong_to_it() -> None:
    edge = torch.tensor([[70.0, -70.0, -2.5], [70.0, 0.0, -0.296875], [70.25, 0.0, -1.0]])
    crop = Crop(top=-0.296875)
    assert thin(edge, crop).tolist() == [[70.0, -70.0, -2.5], [70.0, 0.0, -0.296875]]
    assert thin(torch.tensor([[0.0, 0.0, 1.0]]), crop).shape == (0, 3)
    assert thin(torch.empty(0, 3), crop).shape == (0, 3)


@pytest.mark.parametrize(("points", "repeated"), [(5000, 0), (2048, 0), (1500, 548), (1, 2047)])
def test_resampled_points_are_distinct_as_far_as_they_go(points: int, repeated: int) -> None:
    given = cloud(points)[0]
    found = resample(given, 2048, np.random.default_rng(3))
    rows = {tuple(p) for p in given.tolist()}
    assert found.shape == (2048, 3)
    assert len({tuple(p) for p in found[: 2048 - repeated].tolist()}) == 2048 - repeated
    assert {tuple(p) for p in found.tolist()} <= rows


def test_the_choice_is_the_generators_and_uniform() -> None:
    points = torch.arange(300.0).reshape(100, 3)
    rng = np.random.default_rng(5)
    assert torch.equal(
        resample(points, 30, np.random.default_rng(7)),
        resample(points, 30, np.random.default_rng(7)),
    )
    chosen = torch.cat([resample(points, 30, rng)[:, 0] for _ in range(1000)]) / 3.0
    often = torch.bincount(chosen.long(), minlength=100)
    # binomial with 1000 draws of probability 0.3: deviation 14.5
    assert int(often.sum()) == 30_000
    assert int((often - 300).abs().max()) < 5 * 14.5


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (torch.zeros(4, 4), r"shape \(4, 4\) and type torch.float32 is no list of points"),
        (torch.zeros(4, 3, dtype=torch.int64), "type torch.int64 is no list of points"),
        (torch.tensor([[0.0, 0.0, 0.0], [1.0, torch.nan, 0.0]]), "point 1 of the cloud is"),
    ],
)
def test_what_is_no_cloud_is_refused(points: Tensor, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        thin(points, CROP)


def test_no_points_cannot_be_resampled() -> None:
    with pytest.raises(ValueError, match="no point within the crop"):
        resample(torch.empty(0, 3), 2048, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"voxel": 0.0}, "voxel is 0; it must be a length above 0"),
        ({"half_width": float("nan")}, "half_width is nan"),
        ({"top": -3.0}, r"bottom -2.5 m must be below top -3 m"),
        ({"bottom": float("-inf")}, "both finite"),
        ({"voxel": 1e-5}, "voxel is 1e-05 m, too small for a crop of 140 m"),
    ],
)
def test_a_crop_that_holds_nothing_is_refused(limits: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Crop(**limits)
