"""What scenario files rely on holds for every installed component type."""

from pathlib import Path

import pytest

import scenarios
from orchestrator.parameters import DRAWN, REQUIRED
from orchestrator.registry import installed
from orchestrator.scenario.values import convert, written
from orchestrator.testing import check_component
from orchestrator.timebase import nanoseconds
from orchestrator.units import parse_unit
from tests.adapters.traces import Sample, write_csv

TYPES = sorted(installed())


def test_all_units_of_the_study_are_installed() -> None:
    ours = {"sumo-traffic", "lidar", "perception", "facilities", "channel", "relay-mohed"}
    stand_ins = {"channel-constant-per", "channel-trace", "relay-direct", "policy-blind"}
    assert ours | stand_ins | {"policy-rule-based"} <= set(TYPES)


@pytest.mark.parametrize("name", TYPES)
def test_it_keeps_the_contract_of_components(name: str, tmp_path: Path) -> None:
    """With default parameters and start values: no vehicles but those of traffic itself."""
    assets = Path(scenarios.__file__).parent / "assets" / "red_light"
    street = write_csv(tmp_path / "street.csv", [Sample(id="a", time=t) for t in (0.0, 1.0)])
    table = tmp_path / "table.csv"
    table.write_text("time [s],v [km/h]\n0,1\n")
    required: dict[str, dict[str, object]] = {
        "sumo-traffic": {"scene": assets / "red_light.sumocfg"},
        "fcd-replay": {"file": street},
        "table-source": {"file": table},
        "table-sink": {"folder": tmp_path, "file": "out.csv", "columns": ("v [km/h]",)},
        "channel-trace": {"file": assets / "links.csv"},
    }
    component = installed()[name].load().create(name, required.get(name, {}))
    check_component(component, steps=3, h=nanoseconds("0.1"), seed=1)


@pytest.mark.parametrize("name", TYPES)
def test_parameters_have_known_units_and_defaults_that_can_be_written_out(name: str) -> None:
    for parameter in installed()[name].load().parameters.values():
        parse_unit(parameter.unit)
        assert parameter.doc
        if parameter.default not in (REQUIRED, DRAWN):
            again = convert(parameter, written(parameter, parameter.default), Path())
            assert again == parameter.default
