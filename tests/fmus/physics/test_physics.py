"""The physics that Python units share, against figures and laws from elsewhere."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from shapely.affinity import rotate, translate
from shapely.geometry import Polygon, box

from fmus.physics.boxes import corners, in_boxes
from fmus.physics.error_rate import frame_success
from fmus.physics.propagation import (
    SPEED_OF_LIGHT,
    free_space_loss,
    knife_edge_loss,
    wavelength,
)

PLACE = st.floats(-500, 500)
HEADING = st.floats(-7, 7)
LENGTH = st.floats(0.2, 20)


@given(PLACE, PLACE, HEADING, LENGTH, LENGTH)
def test_corners_are_those_of_a_turned_and_moved_rectangle(
    x: float, y: float, heading: float, length: float, width: float
) -> None:
    """By shapely's own affine transformations, in the same order."""
    found = corners(np.array([x, y]), np.array(heading), np.array([length, width]))
    lying = box(-length / 2, -width / 2, length / 2, width / 2)
    standing = translate(rotate(lying, heading, origin=(0, 0), use_radians=True), x, y)
    assert Polygon(found).exterior.is_ccw
    assert Polygon(found).symmetric_difference(standing).area < 1e-9 * length * width + 1e-9
    front = (found[0] + found[3]) / 2 - (x, y)
    np.testing.assert_allclose(
        front, length / 2 * np.array([math.cos(heading), math.sin(heading)]), atol=1e-9
    )


@given(PLACE, PLACE, HEADING, LENGTH, LENGTH)
def test_in_its_own_frame_every_corner_is_half_the_size_away(
    x: float, y: float, heading: float, length: float, width: float
) -> None:
    center, size = np.array([[x, y]]), np.array([[length, width]])
    found = corners(center, np.array([heading]), size)
    local = in_boxes(found[0][:, None], center, np.array([heading]))[:, 0]
    half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * size / 2
    np.testing.assert_allclose(local, half, atol=1e-9)


def test_boxes_broadcast() -> None:
    found = corners(np.zeros((5, 1, 2)), np.zeros(3), np.ones((3, 2)))
    assert found.shape == (5, 3, 4, 2)


def test_free_space_loss_of_wifi_over_100_m() -> None:
    """5.9 GHz: 20 log10(4 pi 100 m / 0.050812 m) = 87.865 dB; 6 dB more at twice the distance."""
    phase = 4 * math.pi / wavelength(5.9e9)
    near, far = free_space_loss(np.array([100.0, 200.0]), phase)
    assert near == pytest.approx(87.865, abs=1e-3)
    assert far - near == pytest.approx(20 * math.log10(2))
    assert free_space_loss(np.array([0.0, 1e-6]), phase).tolist() == [0.0, 0.0]
    assert wavelength(SPEED_OF_LIGHT) == 1.0


@given(st.floats(-0.69, 8.0))
def test_a_knife_edge_costs_what_fresnel_integrals_say(v: float) -> None:
    """ITU-R P.526-15, equation (30), of which the shared formula is the approximation."""
    middle = (np.arange(20_000) + 0.5) * (v / 20_000)
    angle = 0.5 * np.pi * middle * middle
    c, s = v * float(np.cos(angle).mean()), v * float(np.sin(angle).mean())
    exact = -20 * math.log10(math.hypot(1 - c - s, c - s) / 2)
    assert float(knife_edge_loss(np.array(v))) == pytest.approx(exact, abs=0.35)


def test_an_edge_far_below_the_line_of_sight_costs_nothing() -> None:
    assert knife_edge_loss(np.array([-0.7, -5.0])).tolist() == [0.0, 0.0]


@given(st.floats(-10, 30), st.floats(0, 10), st.integers(1, 1500), st.integers(0, 500))
def test_noise_spares_short_and_strong_frames_more_often(
    snr: float, more: float, size: int, longer: int
) -> None:
    here = frame_success(snr, size)
    assert 0.0 <= frame_success(snr, size + longer) <= here <= frame_success(snr + more, size) <= 1
