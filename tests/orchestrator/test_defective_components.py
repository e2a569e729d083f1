"""A component that somebody has just written breaks the contract: the error says which, and where.

Whatever it does is its own fault, never an internal error, and wherever it steps the words are the
same.
"""

import json
from pathlib import Path

import pytest

from orchestrator.cli import main

PARTS = """\
import sys

from orchestrator import Causality, Component, Connector

Y = Connector(causality=Causality.OUTPUT)


class Sound(Component):
    connectors = {"y": Y}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        pass

    def outputs(self):
        return {"y": 0}


class Leaves(Sound):
    def setup(self, start, rng):
        sys.exit("no licence")  # line 23


class Mute(Sound):
    def outputs(self):
        return None


class Number(Sound):
    connectors = {"y": 3, "z": Y}


class Names(Sound):
    connectors = ["y"]


class Clumsy(Sound):
    @property
    def connectors(self):
        return {"y": self._y}  # line 42


class Refuses(Sound):
    def __init__(self):
        sys.exit("no licence")  # line 47
"""
SCENARIO = """\
schema: 1
title: A part
time: {{stop: 200 ms}}
components:
  part: {{type: "parts:{kind}", step: 100 ms, process: on-request}}
connections: []
"""
NO_CONNECTOR = "a value of type `int`: there belongs a `Connector`"
CASES = {
    "Leaves": ("at t = 0 s: SystemExit: no licence", "23, in setup"),
    "Mute": ("`outputs` returned `NoneType`, not a mapping from names to values", None),
    "Number": (f"`connectors` has under 'y' {NO_CONNECTOR}", None),
    "Names": ("`connectors` is of type `list`, not a mapping from names to connectors", None),
    "Clumsy": (
        "cannot say its connectors: AttributeError: 'Clumsy' object has no attribute '_y'",
        "42, in connectors",
    ),
    "Refuses": ("SystemExit: no licence", "47, in __init__"),
}


@pytest.mark.parametrize("transport", ["in-process", "loopback"])
@pytest.mark.parametrize("kind", CASES)
def test_the_fault_is_the_components(
    kind: str, transport: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "parts.py").write_text(PARTS)
    scenario = tmp_path / "part.yaml"
    scenario.write_text(SCENARIO.format(kind=kind))
    words = ["run", str(scenario), "--out", str(tmp_path / "run"), "--transport", transport]
    assert main([*words, "--quiet", "--json"]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    what, line = CASES[kind]
    assert error["kind"] == "component"
    assert error["component"] == "part"
    assert what in error["message"]
    assert error.get("raised_at") == (line and f"{tmp_path / 'parts.py'}:{line}")
