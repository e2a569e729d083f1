"""The channel's formulas give what Veins gives (by Veins' conventions)."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final, TypeAlias

import pytest

from . import golden
from .primitives import Primitives

GOLDEN: Final = Path(__file__).parent / "golden"
Compare: TypeAlias = Callable[[Primitives, Path], golden.Comparison]

COMPARISONS: Final[dict[str, tuple[Compare, int, float]]] = {
    "path loss, simple": (partial(golden.path_loss, model="simple"), 350, 1e-6),
    "path loss, two-ray": (partial(golden.path_loss, model="tworay"), 100, 1e-6),
    "path loss, breakpoint": (partial(golden.path_loss, model="breakpoint"), 50, 1e-6),
    "antenna gain": (golden.antenna_gain, 25, 1e-9),
    "single buildings": (partial(golden.building_shadowing, category="single"), 160, 1e-6),
    "several buildings": (partial(golden.building_shadowing, category="multi"), 140, 1e-6),
    "corners of buildings": (partial(golden.building_shadowing, category="corner"), 80, 1e-6),
    "inside buildings": (partial(golden.building_shadowing, category="inside"), 160, 1e-6),
    "knife edges over given profiles": (golden.knife_edges, 200, 1e-6),
    "vehicle shadowing": (golden.vehicle_shadowing, 199, 1e-6),
    "error rate": (golden.error_rate, 4 * 496, 1e-9),
}
"""What is compared, the number of its cases, and what their errors are below [dB, or 1]."""


@pytest.mark.parametrize(("compare", "cases", "limit"), COMPARISONS.values(), ids=COMPARISONS)
def test_values_are_those_of_veins(
    primitives: Primitives, compare: Compare, cases: int, limit: float
) -> None:
    compared = compare(primitives, GOLDEN)
    assert compared.cases == cases
    assert compared.error < limit
