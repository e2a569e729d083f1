"""The condition under which a run was made: the levels of all factors but the method."""

from collections.abc import Mapping
from typing import Any, Final

from orchestrator.units import parse_quantity

METHOD: Final = "method"
"""The factor whose levels are compared."""

DENSITY: Final = "density"
"""The factor whose levels set the spacing of vehicles."""

ORACLE: Final = "oracle"
"""The method that the others' regret is measured by."""

Condition = Mapping[str, str]
"""The levels of all factors but the method."""


def condition_of(levels: Mapping[str, str]) -> Condition:
    """The levels without the method."""
    return {factor: level for factor, level in levels.items() if factor != METHOD}


def vehicles_per_km(scenario: Mapping[str, Any]) -> float:
    """Vehicles per km and lane, 1000 / N with the spacing of N metres, of a resolved scenario.

    Raises:
        ValueError: not exactly one component has `background` traffic with a `spacing`.
    """
    found = [
        background["spacing"]
        for component in scenario["components"].values()
        if (background := component["parameters"].get("background")) is not None
    ]
    if len(found) != 1:
        what = f"{len(found)} components of the scenario have a parameter `background.spacing`"
        raise ValueError(f"{what}; one should, to know the density of traffic")
    return 1000.0 / float(parse_quantity(found[0]).number)  # resolved scenarios are in SI units
