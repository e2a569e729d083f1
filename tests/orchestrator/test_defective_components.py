"""A component that somebody has just written breaks the contract: the error says which, and where.

Whatever it does is its own fault, never an internal error, and wherever it steps the words are the
same.
"""

import json
from pathlib import Path

import pytest

from orchestrator.cli import main

PARTS = """\
import asyncio
import sys

import numpy as np
from orchestrator import Causality, Component, Connector

Y = Connector(causality=Causality.OUTPUT)


class Sound(Component):
    connectors = {"y": Y}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        pass

    def outputs(self):
        return {"y": np.asarray(0.0)}


class Leaves(Sound):
    def setup(self, start, rng):
        sys.exit("no licence")  # line 25


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
        return {"y": self._y}  # line 44


class Refuses(Sound):
    def __init__(self):
        sys.exit("no licence")  # line 49


class Fault(Exception):
    def __str__(self):
        return self.text


class Wordless(Sound):
    def step(self, inputs, t, h):
        raise Fault  # line 59


class Late(Sound):
    def step(self, inputs, t, h):
        asyncio.run(self.work())  # line 64

    async def work(self):
        raise asyncio.CancelledError("too late")  # line 67
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
    "Leaves": ("at t = 0 s: SystemExit: no licence", "25, in setup"),
    "Mute": ("`outputs` returned `NoneType`, not a mapping from names to values", None),
    "Number": (f"`connectors` has under 'y' {NO_CONNECTOR}", None),
    "Names": ("`connectors` is of type `list`, not a mapping from names to connectors", None),
    "Clumsy": (
        "cannot say its connectors: AttributeError: 'Clumsy' object has no attribute '_y'",
        "44, in connectors",
    ),
    "Wordless": (
        "at t = 0 s: Fault, which cannot say what is wrong: its `__str__` fails",
        "59, in step",
    ),
    "Late": ("at t = 0 s: CancelledError: too late", "67, in work"),
    "Refuses": ("SystemExit: no licence", "49, in __init__"),
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
