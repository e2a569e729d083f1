"""Neighbours as the definition has them."""

import pytest
import torch

from fmus.driving.point_transformer import neighbours
from fmus.driving.point_transformer.neighbours import gather, nearest, squared_distances

from .clouds import cloud


def test_the_nearest_are_those_of_a_full_sort_in_double_precision() -> None:
    query, points = cloud(100, seed=1, clouds=2), cloud(700, seed=2, clouds=2)
    distance = (query.double()[:, :, None] - points.double()[:, None]).square().sum(3)
    assert torch.equal(nearest(query, points, 16), distance.argsort(2)[:, :, :16])


def test_a_point_is_its_own_first_neighbour() -> None:
    points = cloud(500, clouds=3)
    assert torch.equal(nearest(points, points, 4)[:, :, 0], torch.arange(500).expand(3, 500))


def test_points_that_do_not_count_are_no_neighbours() -> None:
    points, distinct = cloud(300, clouds=3), torch.tensor([300, 100, 5])
    found = nearest(points, points, 16, distinct)
    for c in (0, 1):
        first = points[c : c + 1, : distinct[c]]
        assert torch.equal(found[c], nearest(points[c : c + 1], first, 16)[0])
    few = nearest(points[2:], points[2:, :5], 5)[0]
    assert torch.equal(found[2, :, :5], few)
    assert torch.equal(found[2, :, 5:], few[:, :1].expand(300, 11)), "the nearest stands in"


@pytest.mark.parametrize("block", [1, 5000, 2**30])
def test_the_size_of_the_blocks_does_not_matter(
    block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = cloud(300, clouds=2)
    expected = nearest(points, points, 16)
    monkeypatch.setattr(neighbours, "_CACHED", block)
    assert torch.equal(nearest(points, points, 16), expected)


def test_squared_distances_are_exact_far_from_the_origin() -> None:
    # multiples of 1/64 m below 2^7 m: differences and their squares are exact in float32
    generator = torch.Generator().manual_seed(0)
    grid = torch.randint(-64, 64, (1, 200, 3), generator=generator) / 64.0
    near = squared_distances(grid, grid)
    assert torch.equal(squared_distances(grid + 70.0, grid + 70.0), near)
    assert torch.equal(near, near.transpose(1, 2))
    expected = (grid.double()[:, :, None] - grid.double()[:, None]).square().sum(3)
    assert torch.equal(near.double(), expected)


@pytest.mark.parametrize("shape", [(2,), (2, 7), (2, 7, 3)])
def test_gathering_takes_the_rows_of_the_own_cloud(shape: tuple[int, ...]) -> None:
    values = torch.arange(40.0).reshape(2, 5, 4)
    index = torch.randint(5, shape, generator=torch.Generator().manual_seed(0))
    expected = torch.stack([values[c][index[c]] for c in range(2)])
    assert torch.equal(gather(values, index), expected)
