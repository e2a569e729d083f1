"""The shapes of road users are those of docs/physics-lidar.md, wherever they are written down."""

import itertools
import re
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from fmus.lidar.gpu import scene as torch_scene
from fmus.messages.bodies import Body
from studies.verification.perception import visibility
from tests.fmus.scene import SIZES, Scene, Vehicle

from . import brute_force
from .harness import NO_NOISE, Scan

Box = tuple[float, float, float, float, float]
PAGE: Final = Path(__file__).parents[3] / "docs" / "physics-lidar.md"
AZIMUTHS: Final = 8192
DISTANCE: Final = 12.0


def documented() -> list[tuple[Box, ...]]:
    """The table of the page: rear, front, width, bottom, top of each part, by class."""
    bodies: list[list[Box]] = []
    for row in re.findall(r"^\| (.*?) \|.*?((?: -?\d\.\d\d \|){5})$", PAGE.read_text(), re.M):
        head, numbers = row
        if head[:1].isdigit():
            assert int(head.split()[0]) == len(bodies), "in the order of their codes"
            bodies.append([])
        rear, front, width, bottom, top = map(float, re.findall(r"-?\d\.\d\d", numbers))
        bodies[-1].append((rear, front, width, bottom, top))
    return [tuple(parts) for parts in bodies]


def test_every_form_has_the_shapes_of_the_page() -> None:
    page = documented()
    assert len(page) == len(Body)
    assert list(torch_scene.BODIES) == page
    assert list(brute_force.PARTS) == page
    studied = [
        tuple((p.rear, p.front, p.width, p.bottom, p.top) for p in parts)
        for parts in visibility.PARTS
    ]
    assert studied == page


@pytest.mark.parametrize("body", Body)
def test_a_body_fills_its_size(body: Body) -> None:
    """It stands on the ground, is as long and as high as it says, and nowhere wider."""
    boxes = np.array(documented()[body])
    assert (boxes[:, 1] > boxes[:, 0]).all()
    assert (boxes[:, 4] > boxes[:, 3]).all()
    assert (boxes[:, 0].min(), boxes[:, 1].max()) == (-0.5, 0.5)
    assert (boxes[:, 3].min(), boxes[:, 4].max()) == (0.0, 1.0)
    handlebar = {Body.BICYCLE: 0.75, Body.MOTORCYCLE: 0.65}
    assert boxes[:, 2].max() == handlebar.get(body, 1.0)


@pytest.mark.parametrize("body", Body)
def test_from_the_front_each_part_is_as_wide_as_it_says(scan: Scan, body: Body) -> None:
    """Between two heights the points spread over the widest part there, but for one azimuth."""
    length, width, height = SIZES[body]
    ego = Vehicle(id=1, lidar=True)
    seen = Vehicle(
        id=2, position=(DISTANCE + length / 2, 0.0, 0.0), size=SIZES[body], body=int(body)
    )
    pattern = {"azimuths": AZIMUTHS, "channels": 512, "elevation_top": 0.2}
    cloud = scan(Scene(vehicles=[ego, seen]), **NO_NOISE, **pattern)[1]
    points = cloud.on(2)["position"].astype(float)
    points[:, 2] += cloud.sensor["position"][2]
    boxes = np.array(documented()[body])
    levels = np.unique(boxes[:, 3:]) * height
    for low, high in itertools.pairwise(levels):
        between = (points[:, 2] > low + 1e-3) & (points[:, 2] < high - 1e-3)
        x, y, _ = points[between].T
        standing = (boxes[:, 3] * height <= low + 1e-9) & (boxes[:, 4] * height >= high - 1e-9)
        expected = boxes[standing, 2].max() * width
        step = 2 * np.pi / AZIMUTHS * x.max()
        assert y.max() - y.min() == pytest.approx(expected, abs=2 * step)
        assert abs(y.max() + y.min()) <= 2 * step, "in the middle"
