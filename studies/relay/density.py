"""The points of Figure 7: packet reception rate over the density of traffic."""

from collections.abc import Mapping
from typing import Any, Final

from orchestrator.scenario.units import parse_quantity
from studies.method.estimates import columns, estimate
from studies.relay.sample import METHOD, Condition, Study

FACTOR: Final = "density"
"""The factor whose levels set the spacing of vehicles."""


def vehicles_per_km(scenario: Mapping[str, Any]) -> float:
    """Vehicles per km and lane, 1000 / N with the spacing of N metres, of a resolved scenario.

    Raises:
        ValueError: not exactly one component has a parameter `spacing`.
    """
    found = [
        component["parameters"]["spacing"]
        for component in scenario["components"].values()
        if "spacing" in component["parameters"]
    ]
    if len(found) != 1:
        what = f"{len(found)} components of the scenario have a parameter `spacing`"
        raise ValueError(f"{what}; one should, to know the density of traffic")
    return 1000.0 / float(parse_quantity(found[0]).number)  # resolved scenarios are in SI units


def rows(study: Study) -> list[dict[str, Any]]:
    """The points: by method and density, all other factors at their base levels."""
    found = []
    for method in study.results.experiment.levels[METHOD]:
        points = [
            _point(study, method, condition)
            for condition in _conditions(study)
            if method in study.methods(condition)
        ]
        found += sorted(points, key=lambda point: point["vehicles_per_km"])
    return found


def _conditions(study: Study) -> list[Condition]:
    rest = {factor: level for factor, level in study.base.items() if factor != FACTOR}
    return [
        condition
        for condition in study.conditions
        if all(condition[factor] == level for factor, level in rest.items())
    ]


def _point(study: Study, method: str, condition: Condition) -> dict[str, Any]:
    levels = {METHOD: method, **condition}
    (scenario,) = (
        one.resolved for one in study.results.experiment.combinations if one.levels == levels
    )
    sample = study.sample("prr", method, condition)
    return {
        METHOD: method,
        **condition,
        "vehicles_per_km": vehicles_per_km(scenario),
        "n": len(sample),
        **columns("prr", estimate(list(sample.values()))),
    }
