"""What holds for path loss and antenna patterns."""

import math

import numpy as np
import pytest

from .harness import LIGHT_SPEED
from .primitives import PathLoss, Primitives


def test_free_space_loss_is_the_friis_formula(primitives: Primitives) -> None:
    distance = np.array([1.0, 10.0, 123.4, 1000.0])
    tx = np.zeros((4, 3))
    rx = np.column_stack([distance, np.zeros(4), np.zeros(4)])
    loss = primitives.path_loss(tx, rx, 5.9e9, PathLoss())
    friis = 20 * np.log10(4 * np.pi * distance * 5.9e9 / LIGHT_SPEED)
    np.testing.assert_allclose(loss, friis, rtol=1e-12)


def test_path_loss_is_continuous_down_to_coincident_antennas(primitives: Primitives) -> None:
    distance = np.concatenate([[0.0], np.geomspace(1e-6, 10, 20_000)])
    rx = np.column_stack([distance, np.zeros((len(distance), 2))])
    n = len(distance)
    loss = primitives.path_loss(np.zeros((n, 3)), rx, 5.9e9, PathLoss())
    assert loss[0] == 0
    steps = np.diff(loss)
    assert (steps >= 0).all()
    assert steps.max() < 0.01


@pytest.mark.parametrize(
    "model",
    [
        PathLoss(exponent=3.3, lossless_distance=2.0),
        PathLoss(exponent=0.0),
        PathLoss(model="two_ray", permittivity=1.0),
        PathLoss(model="two_ray", permittivity=5.0),
        PathLoss(model="breakpoint"),
        PathLoss(model="breakpoint", breakpoint_far_loss=20.0),  # leaps up at the breakpoint
    ],
)
def test_path_loss_is_finite_and_no_lower_than_its_bound(
    primitives: Primitives, model: PathLoss
) -> None:
    distance = np.concatenate([[0.0], np.geomspace(1e-160, 1e8, 3000)])
    for heights in ((0.0, 0.0), (1.5, 1.5), (0.0, 8.0), (1e8, 1e8)):
        tx = np.column_stack([np.zeros((len(distance), 2)), np.full(len(distance), heights[0])])
        rx = np.column_stack(
            [distance, np.zeros(len(distance)), np.full(len(distance), heights[1])]
        )
        loss = primitives.path_loss(tx, rx, 5.9e9, model)
        assert np.isfinite(loss).all()
        assert (loss >= 0).all()
        bound = [primitives.lowest_path_loss(5.9e9, model, d) for d in distance[::50]]
        lowest_from_here = np.minimum.accumulate(loss[::-1])[::-1]
        assert (np.array(bound) <= lowest_from_here[::50]).all()


def test_two_rays_over_a_ground_like_air_are_free_space(primitives: Primitives) -> None:
    rx = np.column_stack([np.geomspace(1, 2000, 50), np.zeros(50), np.full(50, 1.5)])
    tx = np.tile([0.0, 0.0, 1.5], (50, 1))
    air = primitives.path_loss(tx, rx, 5.9e9, PathLoss(model="two_ray", permittivity=1.0))
    np.testing.assert_allclose(air, primitives.path_loss(tx, rx, 5.9e9, PathLoss()), atol=1e-6)


def test_two_rays_fall_with_the_fourth_power_far_away(primitives: Primitives) -> None:
    rx = [(1e5, 0, 2.0), (2e5, 0, 2.0)]
    near, far = primitives.path_loss([(0, 0, 1.5)] * 2, rx, 5.9e9, PathLoss(model="two_ray"))
    assert far - near == pytest.approx(40 * math.log10(2), abs=0.05)
    # 40 log10 d - 20 log10(h_t h_r), the textbook's asymptote
    assert far == pytest.approx(40 * math.log10(2e5) - 20 * math.log10(1.5 * 2.0), abs=0.1)


def test_an_antenna_pattern_is_periodic_and_linear_between_its_samples(
    primitives: Primitives,
) -> None:
    samples = [0.0, 4.0, -2.0]
    for turn in (-1e6, -1, 0, 7):
        for share, gain in [(0, 0.0), (1 / 6, 2.0), (1 / 3, 4.0), (2 / 3, -2.0), (5 / 6, -1.0)]:
            azimuth = 2 * math.pi * (turn + share)
            assert primitives.pattern_gain(samples, azimuth) == pytest.approx(gain, abs=1e-8)
    assert primitives.pattern_gain(samples, -1e-300) == pytest.approx(0.0)
