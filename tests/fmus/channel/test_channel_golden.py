"""The channel's formulas give what Veins gives (by Veins' conventions)."""

from pathlib import Path
from typing import Final

import pytest

from . import golden
from .primitives import Primitives

GOLDEN: Final = Path(__file__).parent / "golden"


@pytest.mark.parametrize(("model", "cases"), [("simple", 350), ("tworay", 100), ("breakpoint", 50)])
def test_path_loss(primitives: Primitives, model: str, cases: int) -> None:
    compared = golden.path_loss(primitives, GOLDEN, model)
    assert compared.cases == cases
    assert compared.error < 1e-6


def test_antenna_gain(primitives: Primitives) -> None:
    compared = golden.antenna_gain(primitives, GOLDEN)
    assert compared.cases == 25
    assert compared.error < 1e-9


@pytest.mark.parametrize(
    ("category", "cases"), [("single", 160), ("multi", 140), ("corner", 80), ("inside", 160)]
)
def test_building_shadowing(primitives: Primitives, category: str, cases: int) -> None:
    compared = golden.building_shadowing(primitives, GOLDEN, category)
    assert compared.cases == cases
    assert compared.error < 1e-6


def test_knife_edges_over_given_profiles(primitives: Primitives) -> None:
    compared = golden.knife_edges(primitives, GOLDEN)
    assert compared.cases == 200
    assert compared.error < 1e-6


def test_vehicle_shadowing(primitives: Primitives) -> None:
    compared = golden.vehicle_shadowing(primitives, GOLDEN)
    assert compared.cases == 199
    assert compared.error < 1e-6


def test_error_rate(primitives: Primitives) -> None:
    compared = golden.error_rate(primitives, GOLDEN)
    assert compared.cases == 4 * 496
    assert compared.error < 1e-9
