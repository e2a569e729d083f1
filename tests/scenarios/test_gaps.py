"""What is said when a connection of the red light is left out: an error, with what to write."""

import json
from pathlib import Path
from typing import Final

import pytest

from orchestrator.cli import main
from orchestrator.gaps import gaps
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.system import System

_PATH: Final = Path("scenarios/red_light.yaml")
_LINES: Final = _PATH.read_text().splitlines()
_CONNECTIONS: Final = [
    tuple(end.split(": ")[1] for end in line.strip(" -{}").split(", "))
    for line in _LINES
    if line.startswith("  - {from: ")
]
_UNREAD: Final = ("traffic.vehicle", "policy.vehicle")
"""The truth about all vehicles, which the expert alone reads."""


@pytest.fixture(scope="module")
def whole() -> Assembly:
    return assemble(load_scenario(_PATH, []))


def _is_at(end: object, name: str) -> bool:
    return f"{end}.".startswith(f"{name}.")


def test_all_connections_are_tried() -> None:
    assert len(_CONNECTIONS) == len(load_scenario(_PATH, []).connections) == 29


@pytest.mark.parametrize(("source", "target"), _CONNECTIONS)
def test_no_connection_can_be_left_out_unnoticed(whole: Assembly, source: str, target: str) -> None:
    """All inputs of a connection are an error that names its source, or declared to be unread."""
    system = whole.system
    is_left = [_is_at(c.source, source) and _is_at(c.target, target) for c in system.connections]
    rest = tuple(c for c, left in zip(system.connections, is_left, strict=True) if not left)
    before = gaps(system)
    found = gaps(System(system.components, system.step_sizes, rest))
    new = [gap for gap in found if gap not in before]
    assert sum(len(gap.inputs) for gap in new) == sum(is_left)
    for gap in new:
        assert gap.is_needed is ((source, target) != _UNREAD)
        assert len(gap.fits) == 1
        assert _is_at(gap.fits[0], source)
        assert gap.undriven is not None


def test_the_whole_lacks_nothing_and_says_what_is_not_connected(whole: Assembly) -> None:
    found = {f"{gap.component}.{gap.group}": gap for gap in gaps(whole.system)}
    assert list(found) == [
        "facilities.features",
        "facilities.pose_error.*",
        "channel.probe.transmitter, probe.receiver",
        "channel.probe.carrier",
        "channel.probe.size",
        "relay.pose_error.*",
        "policy.points",
        "policy.received.features",
        "policy.pose_error.*",
    ]
    assert not any(gap.is_needed for gap in found.values())
    assert found["policy.points"].meaning == "no matter: this policy does not read it"


def test_all_that_is_missing_is_told_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line for a group, at the component; exit code 2."""
    left = {
        "  - {from: traffic.vehicle, to: channel.vehicle}",
        "  - {from: facilities.packets, to: channel.packets}",
        "  - {from: policy.command, to: traffic.ego.command}",
    }
    text = "\n".join(each for each in _LINES if each not in left)
    path = tmp_path / "cut.yaml"
    path.write_text(text.replace("assets/", f"{_PATH.parent.absolute()}/assets/"))
    line = _LINES.index("  channel:") + 1
    ego = _LINES.index("        ego:") + 1
    assert main(["check", str(path)]) == 2
    traffic, channel = "components.traffic.parameters.entities.ego", "components.channel"
    assert capsys.readouterr().out == (
        f"{path}:{ego}:9: {traffic}: nothing drives `traffic.ego.command`: `ego` keeps its speed "
        "and heading, whatever is ahead; connect the `command` of a policy, or leave `controller: "
        "policy` out; `policy.command` fits\n"
        f"{path}:{line}:3: {channel}: `channel.vehicle.*` (6 inputs): nothing drives them: there "
        "are no radios, and nothing is sent or received; `traffic.vehicle` fits; `without: "
        "[vehicle]` if that is meant\n"
        f"{path}:{line}:3: {channel}: nothing drives `channel.packets`: nothing is sent, and "
        "nothing is received; `facilities.packets` fits; `without: [packets]` if that is meant\n"
    )


def _without_buildings(words: str, folder: Path) -> Path:
    line = "  - {from: traffic.building, to: channel.building}"
    text = "\n".join(each for each in _LINES if each != line)
    text = text.replace("  channel:\n", f"  channel:\n    without: {words}\n", 1)
    path = folder / "open.yaml"
    path.write_text(text.replace("assets/", f"{_PATH.parent.absolute()}/assets/"))
    return path


def test_absence_can_be_meant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _without_buildings("[building]", tmp_path)
    scenario = load_scenario(path, [])
    assemble(scenario).close()
    assert scenario.resolved()["components"]["channel"]["without"] == ["building"]
    assert main(["graph", str(path)]) == 0
    (line,) = [
        each for each in capsys.readouterr().out.splitlines() if "channel.building.*" in each
    ]
    assert line.endswith("there are no buildings, and none shadows a link (meant)")


def test_words_that_are_no_inputs_or_are_driven_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _without_buildings("[buildings, vehicle, building]", tmp_path)
    at = path.read_text().splitlines().index("    without: [buildings, vehicle, building]") + 1
    assert main(["check", str(path)]) == 2
    first, second = capsys.readouterr().out.splitlines()
    place = "components.channel.without"
    assert first.startswith(f"{path}:{at}:15: {place}[0]: `channel` has no input `buildings`; did")
    assert second == (
        f"{path}:{at}:26: {place}[1]: a connection drives `channel.vehicle.id`; take one of the "
        "two away"
    )


def test_graph_lists_what_nothing_drives(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph", str(_PATH), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["undriven"]
    assert listed[0] == {
        "component": "facilities",
        "inputs": ["features"],
        "declared": True,
        "need": "if offered",
        "meaning": "nobody sends features",
        "meant": False,
        "fits": [],
    }
    assert len(listed) == 9
    assert main(["graph", str(_PATH)]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines.index("inputs that nothing drives, and what it means:")
    assert lines[at + 1].split(maxsplit=1) == ["facilities.features", "nobody sends features"]


@pytest.mark.parametrize(
    "name", ["lidar", "channel", "perception", "facilities", "facilities-cpm", "relay-mohed"]
)
def test_every_input_of_ours_says_what_its_absence_means(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """So does a native unit, by an annotation of its description."""
    assert main(["components", name, "--json"]) == 0
    connectors = json.loads(capsys.readouterr().out)["connectors"]
    inputs = {n: c for n, c in connectors.items() if c["causality"] == "input"}
    assert inputs
    assert all(c["undriven"]["meaning"] for c in inputs.values())
    assert all(set(c["undriven"]["beside"]) <= set(inputs) for c in inputs.values())
    others = [c for c in connectors.values() if c["causality"] == "output"]
    assert all(c["undriven"] is None for c in others)
    assert main(["components", name]) == 0
    assert "an input that nothing drives:" in capsys.readouterr().out
