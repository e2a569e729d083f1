"""Farthest point sampling, from its definition."""

import pytest
import torch
from hypothesis import given, strategies as st
from torch import Tensor

from fmus.driving.point_transformer.neighbours import gather
from fmus.driving.point_transformer.sampling import FarthestPoints, FirstPoints, Sampling

from .clouds import cloud, shuffled

FARTHEST = FarthestPoints()


def chosen_positions(sampling: Sampling, points: Tensor, count: int) -> Tensor:
    return gather(points, sampling.choose(points, count))


def greedy(points: Tensor, first: int, count: int) -> list[int]:
    """The definition, in double precision; points of shape (point, 3)."""
    place, chosen = points.double(), [first]
    while len(chosen) < count:
        from_chosen = torch.cdist(place, place[chosen]).amin(1)
        chosen.append(int(from_chosen.argmax()))
    return chosen


@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_each_next_point_is_the_farthest_from_those_chosen(seed: int, count: int) -> None:
    points = cloud(60, seed=seed)
    chosen = FARTHEST.choose(points, count)[0].tolist()
    assert chosen == greedy(points[0], chosen[0], count)


@given(st.integers(0, 2**32 - 1))
def test_the_first_is_the_farthest_from_the_middle_of_the_bounding_box(seed: int) -> None:
    points = cloud(60, seed=seed)[0].double()
    middle = (points.amin(0) + points.amax(0)) / 2
    expected = int((points - middle).norm(dim=1).argmax())
    assert FARTHEST.choose(points[None], 1).tolist() == [[expected]]


@given(st.integers(0, 2**32 - 1))
def test_the_order_of_the_points_does_not_matter(seed: int) -> None:
    points = cloud(200, seed=seed)
    expected = chosen_positions(FARTHEST, points, 50)
    assert torch.equal(chosen_positions(FARTHEST, shuffled(points)[0], 50), expected)


def test_repeated_points_do_not_matter_while_there_are_others() -> None:
    points = cloud(100)
    padded = torch.cat([points, points[:, :40], points[:, :1].expand(1, 30, 3)], dim=1)
    expected = chosen_positions(FARTHEST, points, 100)
    found = chosen_positions(FARTHEST, padded, 120)
    assert torch.equal(found[:, :100], expected)
    assert {tuple(p) for p in found[0, 100:].tolist()} <= {tuple(p) for p in points[0].tolist()}


@pytest.mark.parametrize("sampling", [FARTHEST, FirstPoints()])
def test_samplings_are_nested_and_clouds_do_not_know_each_other(sampling: Sampling) -> None:
    points = cloud(400, clouds=3)
    found = sampling.choose(points, 100)
    assert torch.equal(sampling.choose(points, 25), found[:, :25])
    for c in range(3):
        assert torch.equal(sampling.choose(points[c : c + 1], 100)[0], found[c])


def test_sampling_the_sample_again_would_give_its_beginning() -> None:
    """So that the encoder need not sample again at every level."""
    sample = chosen_positions(FARTHEST, cloud(400), 100)[0]
    assert greedy(sample, 0, 25) == list(range(25))


def test_farthest_points_cover_the_cloud_better_than_a_random_choice() -> None:
    points = cloud(2048)

    def gap(sampling: Sampling) -> float:
        return float(torch.cdist(points, chosen_positions(sampling, points, 128)).amin(2).max())

    assert gap(FARTHEST) < 0.6 * gap(FirstPoints())
