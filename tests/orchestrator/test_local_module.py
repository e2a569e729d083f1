"""Components in Python files beside a scenario, `module:Class`, without a package."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.placement import spec_of
from orchestrator.recording.reader import Recording
from orchestrator.scenario.build import load_scenario

PARTS = '''\
"""Parts of a vehicle."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from my_numbers import TURN
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector


@dataclass(frozen=True)
class Tyre:
    width: float = parameter(0.2, unit="m", doc="of the tread")


class Wheel(Component):
    """Turns."""

    @dataclass(frozen=True)
    class Parameters:
        radius: float = parameter(0.3, unit="m", doc="of the wheel")
        tyre: Tyre = parameter(Tyre(), doc="around it")

    connectors = {"angle": Connector(causality=Causality.OUTPUT, unit="rad")}

    def __init__(self, parameters):
        self.radius = parameters.radius + parameters.tyre.width
        self.angle = 0.0

    def setup(self, start, rng):
        self.angle = 0.0

    def step(self, inputs, t, h):
        self.angle += TURN / self.radius

    def outputs(self):
        return {"angle": np.asarray(self.angle)}


class Axle:
    pass


class Hub(Component):
    pass
'''

AXLE = PARTS.split("\n").index("class Axle:") + 1
"""The line of the class."""

SCENARIO = """\
schema: 1
title: A wheel
time: {stop: 1 s}
components:
  wheel:
    type: my_parts:Wheel
    step: 100 ms
    process: on-request
    parameters: {radius: 40 cm, tyre: {width: 100 mm}}
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "my_parts.py").write_text(PARTS)
    (tmp_path / "my_numbers.py").write_text("TURN = 0.25\n")
    path = tmp_path / "wheel.yaml"
    path.write_text(SCENARIO)
    return path


def _run(scenario: Path, out: str, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    folder = scenario.parent / out
    assert main(["run", str(scenario), "--out", str(folder), "--json", "--quiet", *options]) == 0
    found: str = json.loads(capsys.readouterr().out)["fingerprint"]
    return found


def _last_angle(folder: Path) -> float:
    return float(np.asarray(Recording(folder)["wheel.angle"][-1]))


def test_a_run_is_the_same_here_and_behind_a_transport_and_has_digests(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = _run(scenario, "here", capsys)
    assert _run(scenario, "there", capsys, "--transport", "loopback") == first
    manifest = json.loads((scenario.parent / "here" / "manifest.json").read_text())
    assert manifest["files"]["wheel"] == {
        name: hashlib.sha256((scenario.parent / name).read_bytes()).hexdigest()
        for name in ("my_parts.py", "my_numbers.py")
    }
    again = scenario.parent / "elsewhere" / "again.yaml"
    again.parent.mkdir()
    again.write_text(json.dumps(manifest["scenario"]))
    assert _run(again, "run", capsys) == first


def test_another_process_finds_the_class_and_its_records(scenario: Path) -> None:
    spec = spec_of(load_scenario(scenario).components["wheel"])
    text = (
        "import json, sys\n"
        "from orchestrator.remote.host import component_type_of\n"
        "from orchestrator.remote.specification import ComponentSpec\n"
        "spec = ComponentSpec.from_document(json.load(sys.stdin))\n"
        "print(component_type_of(spec).create(spec.name, spec.values).radius)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", text],
        input=json.dumps(spec.to_document()),
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(done.stdout) == 0.5


def test_check_graph_and_components_know_it(
    scenario: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["check", str(scenario)]) == 0
    assert main(["graph", str(scenario)]) == 0
    assert "my_parts:Wheel" in capsys.readouterr().out
    monkeypatch.chdir(scenario.parent)
    assert main(["components", "my_parts:Wheel"]) == 0
    assert "my_parts:Wheel: Turns." in capsys.readouterr().out


def test_overrides_know_its_parameters(scenario: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = _run(scenario, "a", capsys)
    change = ("--set", "components.wheel.parameters.tyre.width=200 mm")
    assert _run(scenario, "b", capsys, *change) != before


def test_a_file_that_has_changed_is_read_again(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = _run(scenario, "a", capsys)
    (scenario.parent / "my_parts.py").write_text(PARTS.replace("+= TURN", "+= 2 * TURN"))
    assert _run(scenario, "b", capsys) != before


def test_a_file_that_has_changed_within_a_second_to_the_same_length_is_read_again(
    scenario: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python would take the code that it keeps for such a file to be of it."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = scenario.parent / "my_parts.py"
    for text in (PARTS, PARTS.replace("+= TURN", "-= TURN")):
        path.write_text(text)
        os.utime(path, (1e9, 1e9))
        fingerprint = _run(scenario, "first" if text is PARTS else "second", capsys)
    assert _run(scenario, "once more", capsys) == fingerprint
    assert _last_angle(scenario.parent / "first") > 0.0 > _last_angle(scenario.parent / "second")


@pytest.mark.parametrize(
    ("reference", "old", "new", "problem"),
    [
        ("my_parts:Weel", "", "", "`my_parts.py` has no class `Weel`; did you mean `Wheel`?"),
        ("my_part:Wheel", "", "", "my_part.py` for `my_part:Wheel`"),
        ("my_parts:Axle", "", "", f"my_parts.py:{AXLE}: `Axle` is not a subclass of `Component`"),
        (
            "my_parts:Hub",
            "",
            "",
            f"my_parts.py:{AXLE + 4}: `Hub` does not define `connectors`, `outputs`",
        ),
        ('":Wheel"', "", "", "/.py` for `:Wheel`"),
        ('".:Wheel"', "", "", "/.py` for `.:Wheel`"),
        ('"/:Wheel"', "", "", "`/.py` for `/:Wheel`"),
        ("my_parts:Wheel", "class Axle:", "class Axle", f"my_parts.py:{AXLE}:11: expected ':'"),
        ("my_parts:Wheel", "TURN\n", "TURNS\n", "my_parts.py:8: ImportError: cannot import name"),
    ],
)
def test_what_is_wrong_is_said_at_the_type_with_the_line_of_the_file(
    scenario: Path, reference: str, old: str, new: str, problem: str
) -> None:
    parts = scenario.parent / "my_parts.py"
    parts.write_text(parts.read_text().replace(old, new, 1) if old else parts.read_text())
    scenario.write_text(SCENARIO.replace("my_parts:Wheel", reference))
    with pytest.raises(ScenarioError) as error:
        load_scenario(scenario)
    (found,) = error.value.problems
    assert (found.where.line, found.where.column) == (6, 11)
    assert found.what.startswith("components.wheel.type: ")
    assert problem in found.what
