"""Start values, tolerance, stop time and variables inside: what a scenario may say of any FMU."""

import json
from pathlib import Path
from typing import Any

import pytest

from adapters.fmi import FmuComponentType
from adapters.fmu_command import add_command
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit
from orchestrator.component import Component
from orchestrator.randomness import stream
from orchestrator.recording.reader import Recording
from orchestrator.table_files import read_table
from tests.adapters.fmu.descriptions import changed
from tests.commands import executed

SCENARIO = """\
schema: 1
title: Starts
time: {stop: 2 s}
components:
  starts:
    fmu: starts3.fmu
    step: 1 s
    process: on-request
    parameters:
      start.x: 3 m
      start.u: 40 dm
      fmi.tolerance: 1e-4
      fmi.locals: [twice, "der(*)"]
"""


def started(path: Path, **values: Any) -> Component:
    named = {name.replace("__", "."): value for name, value in values.items()}
    component = FmuComponentType(path).create("starts", named)
    component.setup(0, stream(1, "starts"))
    component.initialise({name: c.start_value() for name, c in component.connectors.items()})
    return component


@pytest.fixture
def scenario(starts3: Path, tmp_path: Path) -> Path:
    (tmp_path / "starts3.fmu").write_bytes(starts3.read_bytes())
    path = tmp_path / "starts.yaml"
    path.write_text(SCENARIO)
    return path


def test_what_can_be_chosen_is_offered_with_unit_bounds_and_default(starts3: Path) -> None:
    """What is calculated has no start value to choose; a first guess says that it is one."""
    offered = FmuComponentType(starts3).parameters
    chosen = {"fmi.tolerance", "fmi.locals", "fmi.logging"}
    assert set(offered) == {"start.u", "start.x", "start.guess", *chosen}
    u, x = offered["start.u"], offered["start.x"]
    assert (u.default, u.unit, u.maximum, u.doc) == (2.0, "m", 9.0, "start value of this input")
    assert (x.default, x.doc) == (1.0, "start value of this state: grows with time")
    assert offered["start.guess"].doc == "start value of this local, a first guess"


@pytest.mark.parametrize(
    ("values", "y"),
    [
        ({}, 1 + 20 + 500),
        ({"start__x": 3.0}, 3 + 20 + 500),
        ({"start__u": 4.0}, 1 + 40 + 500),
        ({"start__guess": 7.0}, 1 + 20 + 700),
        ({"start__x": 3.0, "start__u": 4.0, "start__guess": 7.0}, 3 + 40 + 700),
    ],
)
def test_start_values_arrive_when_the_fmu_takes_them(
    starts3: Path, values: dict[str, float], y: float
) -> None:
    component = started(starts3, **values)
    assert component.outputs()["y"] == y
    component.close()


def test_an_input_that_nothing_drives_keeps_its_start_value(starts3: Path) -> None:
    component = FmuComponentType(starts3).create("starts", {"start.u": 4.0})
    assert component.connectors["u"].start_value() == 4.0


def test_nothing_said_is_said_to_nobody(starts3: Path) -> None:
    """Without tolerance and stop time the FMU hears that neither is defined."""
    component = started(starts3)
    assert component.outputs()["tolerance"] == -1.0
    assert component.outputs()["stop"] == -1.0
    assert set(component.outputs()) == {"y", "tolerance", "stop"}
    component.close()


@pytest.mark.parametrize("transport", ["in-process", "loopback"])
def test_a_scenario_says_it_all(scenario: Path, tmp_path: Path, transport: str) -> None:
    """The stop time is that of the run; variables inside are recorded like any output."""
    out = tmp_path / transport
    assert (
        main(["run", str(scenario), "--out", str(out), "--transport", transport, "--no-figure"])
        == 0
    )
    run = Recording(out)
    assert run["starts.stop"].at(0) == 2.0
    assert run["starts.tolerance"].at(0) == 1e-4
    assert [float(run["starts.y"].at(k * 10**9)) for k in range(3)] == [543.0, 544.0, 545.0]
    assert [float(run["starts.twice"].at(k * 10**9)) for k in range(3)] == [6.0, 8.0, 10.0]
    assert set(run.signals) == {
        f"starts.{name}" for name in ("y", "tolerance", "stop", "twice", "der(x)")
    }


def test_the_manifest_repeats_the_run_and_says_no_more_than_the_scenario(
    scenario: Path, tmp_path: Path
) -> None:
    first, again, second = tmp_path / "first", tmp_path / "again.yaml", tmp_path / "second"
    assert main(["run", str(scenario), "--out", str(first), "--no-figure"]) == 0
    resolved = json.loads((first / "manifest.json").read_text())["scenario"]
    assert resolved["components"]["starts"]["parameters"] == {
        "start.x": "3.0 m",
        "start.u": "4.0 m",
        "fmi.tolerance": 1e-4,
        "fmi.locals": ["twice", "der(*)"],
    }
    again.write_text(json.dumps(resolved))
    assert main(["run", str(again), "--out", str(second), "--no-figure"]) == 0
    assert Recording(second).fingerprint() == Recording(first).fingerprint()


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("start.x: 3 m", "start.x: 3 s", 'start.x: "3 s": expected a length (m), got a time (s)'),
        ("start.x: 3 m", "start.y: 3 m", "start.y: there is no parameter `start.y`"),
        ("40 dm", "100 dm", "start.u: must be at most 9 m, got 10 m"),
        ("1e-4", "-1", "fmi.tolerance: must be at least 0, got -1"),
        ("[twice, ", "[twic, ", "fmi.locals[0]: no variable inside matches `twic`; did you mean"),
        ('"der(*)"', "y", "fmi.locals[1]: no variable inside matches `y`"),
    ],
)
def test_mistakes_are_located(
    scenario: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, problem: str
) -> None:
    assert SCENARIO.count(old) == 1
    scenario.write_text(SCENARIO.replace(old, new))
    assert main(["check", str(scenario)]) == 2
    (line,) = capsys.readouterr().out.splitlines()
    number = SCENARIO[: SCENARIO.index(old)].count("\n") + 1
    assert line.startswith(f"{scenario}:{number}:")
    assert f"components.starts.parameters.{problem}" in line


def test_a_run_of_one_fmu_says_the_same_without_prefixes(starts3: Path, tmp_path: Path) -> None:
    """States and guesses by their names; variables inside are recorded on request only."""
    out = tmp_path / "out.csv"
    words = ("fmu", "run", str(starts3), "--stop-time", "2", "--step", "1", "--quiet")
    starts = ("--start-value", "x=300 cm", "--start-value", "guess=5", "--start-value", "u=40 dm")
    record = ("--record", "*", "--record", "der(x)", "--record", "tw*ce")
    outcome = executed(add_command, *words, *starts, *record, "--output", str(out))
    assert outcome.exit_code is Exit.DONE, outcome.text
    found = read_table(out)
    assert list(found) == ["time", "y", "tolerance", "stop", "twice", "der(x)"]
    assert found["y"].tolist() == [543.0, 544.0, 545.0]
    assert found["twice"].tolist() == [6.0, 8.0, 10.0]
    assert "twice" not in executed(add_command, *words, "--record", "*").text
    wrong = executed(add_command, *words, "--start-value", "gues=5")
    assert (
        "--start-value gues: there is no such parameter or input; did you mean `guess`?"
        in wrong.text
    )
    assert "--start-value x: " in executed(add_command, *words, "--start-value", "x=3 s").text
    wrong = executed(add_command, *words, "--start-value", "u=3 s")
    assert "--start-value u: '3 s' is no number in m" in wrong.text


def test_a_table_of_inputs_may_have_units(starts3: Path, tmp_path: Path) -> None:
    """`u` is in metres; y is x + 10 u + 100 guess."""
    words = ("fmu", "run", str(starts3), "--stop-time", "2", "--step", "1", "--quiet")
    table, out = tmp_path / "in.csv", tmp_path / "out.csv"
    found = []
    for heading, value in (("u", 3), ("u [m]", 3), ("u [cm]", 300)):
        table.write_text(f"time [s],{heading}\n0,{value}\n")
        outcome = executed(add_command, *words, "--input", str(table), "--output", str(out))
        assert outcome.exit_code is Exit.DONE, outcome.text
        found.append(read_table(out)["y"].tolist())
    assert found[0] == found[1] == found[2] == [531.0, 532.0, 533.0]
    table.write_text("time,u [s]\n0,1\n")
    outcome = executed(add_command, *words, "--input", str(table))
    assert f"{table}:1: `u`: expected a length (m), got a time (s)" in outcome.text


@pytest.mark.parametrize(
    ("relative", "x", "u"), [(b"", 2.0, 4.0), (b' relativeQuantity="true"', 4.0, 6.0)]
)
def test_units_are_those_that_the_fmu_defines(
    starts3: Path, tmp_path: Path, relative: bytes, x: float, u: float
) -> None:
    """A stride is half a metre from the first metre on; of differences that does not count.

    FMI 2.0.4, sections 2.2.2 and 2.2.3.
    """
    stride = b'<Unit name="stride"><BaseUnit m="1" factor="0.5" offset="1"/></Unit>'
    changes = (
        (b'<Unit name="m"><BaseUnit m="1"/></Unit>', stride),
        (b'unit="m"', b'unit="stride"' + relative),
    )
    fmu = changed(starts3, tmp_path, *changes)
    table, out = tmp_path / "in.csv", tmp_path / "out.csv"
    table.write_text("time [s],u [m]\n0,3\n")
    words = ("fmu", "run", str(fmu), "--stop-time", "2", "--step", "1", "--output", str(out))
    inputs = (
        ("--start-value", "u=3 m"),
        ("--start-value", f"u={u} stride"),
        ("--input", str(table)),
    )
    for way in inputs:
        outcome = executed(add_command, *words, "--quiet", "--start-value", "x=2 m", *way)
        assert outcome.exit_code is Exit.DONE, outcome.text
        assert read_table(out)["y"].tolist()[0] == x + 10 * u + 500
    file, wire = tmp_path / "starts.yaml", "connections: [{value: 3 m, to: starts.u}]\n"
    for start, connection in (("3 m", ""), (f"{u} stride", ""), ("1 stride", wire)):
        text = SCENARIO.replace("3 m", "2 m").replace("40 dm", start).replace("der(*)", "der(x)")
        file.write_text(text + connection)
        folder = tmp_path / f"run{start}{bool(connection)}"
        assert main(["run", str(file), "--out", str(folder), "--quiet"]) == Exit.DONE
        assert Recording(folder)["starts.y"][0] == x + 10 * u + 500


def test_a_unit_that_nobody_defines_has_a_message(
    starts3: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unit = b'<Unit name="stride"/>'
    changes = ((b'<Unit name="m"><BaseUnit m="1"/></Unit>', unit), (b'unit="m"', b'unit="stride"'))
    changed(starts3, tmp_path, *changes)
    file = tmp_path / "starts.yaml"
    file.write_text(SCENARIO.replace("40 dm", "4 stride"))
    assert main(["check", str(file)]) == Exit.WRONG_INPUT
    told = capsys.readouterr().out
    assert 'starts.yaml:10:16: components.starts.parameters.start.x: "3 m": nobody says' in told
    assert "write a number in it, or with `stride` behind it" in told
