"""FMUs for Model Exchange in systems, scenarios and on the command line."""

import csv
import json
import math
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.kind import Kind
from adapters.fmi.model_exchange.solvers import NAMES
from adapters.fmu_command import KINDS, SOLVERS, add_command
from orchestrator.algorithm.adaptive import Adaptive
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from tests.commands import executed

MS = 1_000_000
STARTS, STOP = (("a", 12.0), ("b", 8.0)), 1600 * MS


def without_units(fmu: Path, folder: Path) -> Path:
    """A copy in which a height may be an acceleration."""
    path = folder / fmu.name
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b' unit="m/s2"', b"").replace(b' unit="m"', b"")
            new.writestr(name, data)
    return path


def error_of(fmu: Path, algorithm: CosimulationAlgorithm, step: int, folder: Path) -> float:
    """The error at the end of a'' = b, b'' = a, with two FMUs that read each other.

    a + b grows as cosh t, a - b swings as cos t.
    """
    values = {"g": 0.0, "fmi.solver": "rk4"}
    components = {
        name: FmuComponentType(fmu).create(name, values | {"start.h": h}) for name, h in STARTS
    }
    ends = (("a", "b"), ("b", "a"))
    connections = [Connection(Endpoint(a, "h"), Endpoint(b, "u")) for a, b in ends]
    system = System(components, dict.fromkeys(components, step), connections)
    simulate(system, algorithm, start=0, stop=STOP, seed=0, observers=[Recorder(folder)])
    run = Recording(folder)
    t = STOP * 1e-9
    exact = 10 * math.cosh(t) + 2 * math.cos(t)
    return abs(float(run["a.h"].at(STOP)) - exact)


ORDERS: dict[str, tuple[CosimulationAlgorithm, float, float]] = {
    "jacobi": (Jacobi(), 1.0, 1.0),
    "gauss-seidel, linear": (GaussSeidel(("a", "b"), extrapolation="linear"), 2.0, 0.2),
    "quasi-newton, linear": (InterfaceQuasiNewton(interpolation="linear"), 2.0, 0.1),
    "quasi-newton, quadratic": (InterfaceQuasiNewton(interpolation="quadratic"), 3.0, 0.01),
}


@pytest.mark.parametrize("name", ORDERS)
def test_coupled_fmus_follow_inputs_with_the_order_of_the_algorithm(
    ball: Path, tmp_path: Path, name: str
) -> None:
    algorithm, order, largest = ORDERS[name]
    steps = (200 * MS, 100 * MS, 50 * MS)
    fmu = without_units(ball, tmp_path)
    errors = [error_of(fmu, algorithm, step, tmp_path / str(step)) for step in steps]
    assert errors[0] < largest
    found = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert found == pytest.approx(order, abs=0.15)


SCENARIO = """\
schema: 1
title: A ball
time: {stop: 1 s}
components:
  ball:
    fmu: ball.fmu
    step: 50 ms
    process: true
    parameters:
      drag: 0.3
      period: 0.07 s
      start.h: 1.5 m
      fmi.tolerance: 1e-7
      fmi.locals: [energy]
"""


@pytest.fixture
def scenario(ball: Path, tmp_path: Path) -> Path:
    (tmp_path / "ball.fmu").write_bytes(ball.read_bytes())
    path = tmp_path / "ball.yaml"
    path.write_text(SCENARIO)
    return path


def test_a_run_has_the_same_bytes_in_another_process(scenario: Path, tmp_path: Path) -> None:
    fingerprints = []
    for k, transport in enumerate(("in-process", "local", "in-process")):
        out = tmp_path / str(k)
        words = [
            "run",
            str(scenario),
            "--no-figure",
            "--out",
            str(out),
            "--quiet",
            "--transport",
            transport,
        ]
        assert main(words) == 0
        fingerprints.append(json.loads((out / "manifest.json").read_text())["fingerprint"])
        run = Recording(out)
        assert int(run["ball.ticks"].at(1000 * MS)) == 14
        assert float(run["ball.energy"].at(0)) == pytest.approx(9.81 * 1.5)
    assert len(set(fingerprints)) == 1


COUPLED = """\
schema: 1
title: Two that read each other
time: {stop: 400 ms}
coupling: {algorithm: quasi-newton, interpolation: quadratic}
components:
  a: {fmu: ball.fmu, step: 50 ms, process: true, parameters: {g: 0, start.h: 12 m}}
  b: {fmu: ball.fmu, step: 50 ms, process: true, parameters: {g: 0, start.h: 8 m}}
connections:
  - {from: a.h, to: b.u}
  - {from: b.h, to: a.u}
"""


def test_processes_follow_inputs_as_well(ball: Path, tmp_path: Path) -> None:
    """To the bit, with returns to saved states and slopes of outputs."""
    (tmp_path / "ball.fmu").write_bytes(without_units(ball, tmp_path).read_bytes())
    path = tmp_path / "two.yaml"
    path.write_text(COUPLED.replace(" m}", "}"))
    found = []
    for transport in ("in-process", "local"):
        out = tmp_path / transport
        words = [
            "run",
            str(path),
            "--no-figure",
            "--out",
            str(out),
            "--quiet",
            "--transport",
            transport,
        ]
        assert main(words) == 0
        found.append(json.loads((out / "manifest.json").read_text())["fingerprint"])
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("fail_at: 0.42 s", "component `ball` at t = 0.4 s: "),
        ("fail_as: 4, fail_at: 0.42 s", "returned Fatal: told to fail"),
    ],
)
def test_what_fails_ends_a_run_by_name_and_time(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], change: str, said: str
) -> None:
    scenario.write_text(
        SCENARIO.replace("    parameters:\n", "    parameters:\n" + indented(change))
    )
    words = ["run", str(scenario), "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]
    assert main(words) == Exit.COMPONENT_FAILED
    assert said in capsys.readouterr().err


def indented(changes: str) -> str:
    return "".join(f"      {each}\n" for each in changes.split(", "))


def test_check_and_graph_say_how_it_is_integrated(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(scenario)]) == 0
    said = "`ball`: Model Exchange by cvode, relative tolerance 1e-07"
    assert f"{scenario}:5:3: {said}\n" in capsys.readouterr().out
    scenario.write_text(
        SCENARIO.replace("fmi.tolerance: 1e-7", "fmi.solver: rk4\n      fmi.step: 2 ms")
    )
    assert main(["graph", str(scenario)]) == 0
    said = "(Model Exchange by rk4, steps of 0.002 s at most between communication points)"
    assert said in capsys.readouterr().out
    scenario.write_text(SCENARIO + "      fmi.step: 2 ms\n")
    assert main(["check", str(scenario)]) == 0
    said = "Model Exchange by cvode, relative tolerance 1e-07, steps of 0.002 s at most\n"
    assert said in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("fmi.solver: rk5", "{}:15:19: components.ball.parameters.fmi.solver: "),
        ("fmi.step: 0 s", "{}:15:17: components.ball.parameters.fmi.step: must be greater than 0"),
        ("fmi.step: 1 m", "{}:15:17: components.ball.parameters.fmi.step: "),
        ("fmi.kind: co-simulation", "{}:15:17: components.ball.parameters.fmi.kind: "),
    ],
)
def test_wrong_options_are_told_with_their_place(
    scenario: Path, capsys: pytest.CaptureFixture[str], line: str, said: str
) -> None:
    scenario.write_text(SCENARIO + f"      {line}\n")
    assert main(["check", str(scenario)]) == Exit.WRONG_INPUT
    captured = capsys.readouterr()
    assert said.format(scenario) in captured.out + captured.err


def run(fmu: Path, *words: str | Path) -> Outcome:
    return executed(add_command, "fmu", "run", str(fmu), "--quiet", *map(str, words))


def table(path: Path) -> dict[str, list[float]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def test_it_is_what_fmpy_simulates(ball: Path, tmp_path: Path) -> None:
    """By the same solver, to the same tolerance: within some of these, bounces included."""
    out = tmp_path / "out.csv"
    words = ("--solver", "cvode", "--tolerance", "1e-9", "--step", "0.05", "--stop-time", "1")
    outcome = run(ball, *words, "--start-value", "drag=0.5", "--output", out)
    assert outcome.exit_code is Exit.DONE, outcome.text
    assert outcome.text.splitlines()[-2].endswith("20 steps of 0.05 s, Model Exchange by cvode")
    theirs: Any = fmpy.simulate_fmu(
        str(ball), stop_time=1.0, output_interval=0.05, relative_tolerance=1e-9,
        start_values={"drag": 0.5}, output=["h", "v", "bounces"], fmi_type="ModelExchange",
        record_events=False, set_stop_time=False,
    )  # fmt: skip
    ours = table(out)
    assert ours["bounces"] == list(theirs["bounces"])
    for name in ("h", "v"):
        assert ours[name] == pytest.approx(list(theirs[name]), abs=2e-7)


def test_the_command_line_chooses_solver_and_step(ball: Path) -> None:
    found = [
        run(ball, "--solver", "euler", "--solver-step", step, "--stop-time", "0.4").data["last"][
            "v"
        ]
        for step in ("0.01", "0.001")
    ]
    assert found == pytest.approx([-9.81 * 0.4] * 2, rel=1e-12)
    heights = [
        run(ball, "--solver", "euler", "--solver-step", step, "--stop-time", "0.4").data["last"][
            "h"
        ]
        for step in ("0.01", "0.001")
    ]
    # x'' = -g with explicit Euler: -g t^2 / 2 + g t h / 2
    assert heights == pytest.approx([1 - 9.81 * 0.4 * (0.4 - h) / 2 for h in (0.01, 0.001)])
    assert tuple(kind.value for kind in Kind) == KINDS
    assert SOLVERS == NAMES


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--kind", "co-simulation"), "--kind co-simulation: the FMU has no Co-Simulation, only"),
        (("--tolerance", "x"), "--tolerance x: write a number greater than 0"),
        (("--solver-step", "0"), "--solver-step 0: write a number greater than 0"),
        (("--solver", "rk4", "--kind", "co-simulation"), "--solver is for Model Exchange, not for"),
    ],
)
def test_a_wrong_option_is_said(ball: Path, words: tuple[str, ...], said: str) -> None:
    outcome = run(ball, *words)
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert said in outcome.text


def test_a_solver_needs_an_equation(lag2: Path) -> None:
    for words, asked in (
        (("--solver", "rk4"), "--solver"),
        (("--solver-step", "1"), "--solver-step"),
    ):
        outcome = run(lag2, *words)
        assert outcome.exit_code is Exit.WRONG_INPUT
        assert f"{asked}: the FMU has no Model Exchange, only Co-Simulation" in outcome.text


def test_info_counts_what_is_integrated(ball: Path) -> None:
    outcome = executed(add_command, "fmu", "info", str(ball))
    assert outcome.data["model_exchange"] == {"states": 2, "event_indicators": 1}
    assert "to be integrated: states: 2, event indicators: 1\n" in outcome.text


def test_adaptive_steps_of_coupled_fmus_follow_the_tolerance(ball: Path, tmp_path: Path) -> None:
    """A tenth of the tolerance, about a tenth of the error, at the same communication step."""
    fmu = without_units(ball, tmp_path)
    errors = [
        error_of(fmu, Adaptive(relative_tolerance=e), 200 * MS, tmp_path / str(e))
        for e in (1e-3, 1e-4)
    ]
    assert errors[0] < 0.02
    assert 5 < errors[0] / errors[1] < 14
