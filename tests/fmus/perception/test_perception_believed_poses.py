"""Scans come with the poses that vehicles believe to have: what follows them, and what does not."""

import numpy as np

from fmus.localisation import Offsets, stamped
from tests.fmus.driver import Library

from .harness import Outputs, Perception
from .scene import car, cloud, look

AHEAD = 7.0
"""Of the matrix [m]."""
SHIFTS = {1: (1.5, -2.0), 2: (-0.7, 0.4)}
"""By how much each vehicle is wrong [m]."""


def sighting() -> bytes:
    boxes = [car(5, 14, 7), car(6, -20, -5, height=3.0)]
    return cloud(*(look(v, (9.0 * v, 2.0), boxes) for v in SHIFTS))


def seen(library: Library, heading: float | None) -> Outputs:
    """With exact poses, or with the shifts and this error of the headings [rad]."""
    points = sighting()
    if heading is not None:
        offsets = Offsets(
            vehicle=np.array(list(SHIFTS)),
            position=np.array(list(SHIFTS.values())),
            heading=np.full(len(SHIFTS), heading),
        )
        points = stamped(points, offsets)
    with Perception(library, offset=AHEAD) as unit:
        return unit.step(points, ego=1)


def test_only_what_depends_on_the_pose_is_off(library: Library) -> None:
    """Cells are as measured; positions follow the believed pose of their vehicle as one body."""
    truth, shifted, turned = (seen(library, error) for error in (None, 0.0, 0.3))
    for exact, off, askew in zip(truth.apms, shifted.apms, turned.apms, strict=True):
        shift = SHIFTS[exact.vehicle]
        np.testing.assert_allclose(off.position - exact.position, shift, atol=1e-12)
        np.testing.assert_allclose(off.center - exact.center, shift, atol=1e-12)
        assert (off.heading, askew.heading) == (exact.heading, exact.heading + 0.3)
        direction = np.array([np.cos(askew.heading), np.sin(askew.heading)])
        np.testing.assert_allclose(askew.center, askew.position + AHEAD * direction, atol=1e-9)
        for other in (off, askew):
            np.testing.assert_array_equal(other.cells, exact.cells)
    assert len(truth.objects) == len(shifted.objects) > 0
    for exact, off in zip(truth.objects, shifted.objects, strict=True):
        assert (off["points"], off["height"]) == (exact["points"], exact["height"])
        assert off["angle"] == exact["angle"]
        np.testing.assert_allclose(off["size"], exact["size"], atol=1e-12)
        shift = SHIFTS[int(exact["sensor"])]
        np.testing.assert_allclose(off["position"] - exact["position"], shift, atol=1e-9)
    for exact, askew in zip(truth.objects, turned.objects, strict=True):
        turn = (askew["angle"] - exact["angle"] - 0.3) % (np.pi / 2)
        assert min(turn, np.pi / 2 - turn) < 1e-9
        np.testing.assert_allclose(np.sort(askew["size"]), np.sort(exact["size"]), atol=1e-9)


def test_blind_zones_follow_the_pose_of_the_ego(library: Library) -> None:
    truth, shifted = seen(library, None), seen(library, 0.0)
    used = truth.ranges > 0
    assert used.any()
    np.testing.assert_allclose((shifted.centers - truth.centers)[used], [SHIFTS[1]] * used.sum())
    np.testing.assert_array_equal(shifted.ranges, truth.ranges)
