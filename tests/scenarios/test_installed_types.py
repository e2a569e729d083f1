"""What scenario files rely on holds for every installed component type."""

from pathlib import Path

import pytest

from orchestrator.parameters import DRAWN, REQUIRED
from orchestrator.registry import installed
from orchestrator.scenario.units import parse_unit
from orchestrator.scenario.values import convert, written

TYPES = sorted(installed())


def test_all_units_of_the_study_are_installed() -> None:
    ours = {"sumo-traffic", "lidar", "perception", "facilities", "channel", "relay-mohed"}
    assert ours | {"relay-direct", "policy-rule-based", "policy-blind"} <= set(TYPES)


@pytest.mark.parametrize("name", TYPES)
def test_parameters_have_known_units_and_defaults_that_can_be_written_out(name: str) -> None:
    for parameter in installed()[name].load().parameters.values():
        parse_unit(parameter.unit)
        assert parameter.doc
        if parameter.default not in (REQUIRED, DRAWN):
            again = convert(parameter, written(parameter, parameter.default), Path())
            assert again == parameter.default
