"""What is known of a component before its parameters are; and what its library prints."""

import json
import subprocess
import sys

import pytest

from adapters.replay import FcdReplay
from adapters.sumo.component import SumoTraffic
from adapters.sumo.connectors import connectors
from adapters.traffic.connectors import SURROUNDINGS, VEHICLES
from orchestrator.cli import main


@pytest.mark.parametrize(
    ("name", "some"),
    [
        ("sumo-traffic", ["vehicle.id", "light.state", "<entity>.command", "encounter.over"]),
        ("fcd-replay", ["vehicle.position", "building.vertex", "entered"]),
        ("channel-trace", ["packets", "receptions"]),
        ("table-source", ["<column>"]),
        ("table-sink", ["<column>"]),
    ],
)
def test_connectors_are_listed_before_there_are_parameters(
    name: str, some: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["components", name, "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["connectors"]
    assert set(some) <= set(listed)
    assert main(["components", name]) == 0
    text = capsys.readouterr().out
    assert "known once the parameters are" not in text
    assert all(each in text for each in some)


def test_those_of_traffic_are_those_of_an_instance() -> None:
    """But for the name of the entity."""
    foreseen = SumoTraffic.foreseen_connectors()
    kinds = {name.replace("<entity>", "ego"): each.kind() for name, each in foreseen.items()}
    assert kinds == {name: each.kind() for name, each in connectors(("ego",)).items()}
    assert dict(FcdReplay.connectors) == {**VEHICLES, **SURROUNDINGS}


def test_libsumo_prints_nothing_of_its_own_on_the_screen() -> None:
    """It would warn of another version of Arrow than the one that it brings along."""
    program = "from adapters.sumo import connection; connection._libsumo()"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("", "")
