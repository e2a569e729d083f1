"""Energy that a coupling makes or loses: closed forms, and what the subsystems gained."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.cli import main
from orchestrator.measure import Answer
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.timebase import Duration, nanoseconds
from studies.measures.energy import Bond, CouplingEnergy
from tests.orchestrator.linear_parts import Network, Part
from tests.orchestrator.mechanics import moved
from tests.orchestrator.test_extrapolation import FOLLOWS

SPRING = Bond(effort="right.f", flow="left.v")
COUPLINGS: Mapping[str, tuple[CosimulationAlgorithm, Mapping[str, str]]] = {
    "jacobi": (Jacobi(), {"algorithm": "jacobi"}),
    "jacobi linear": (
        Jacobi(extrapolation="linear"),
        {"algorithm": "jacobi", "extrapolation": "linear"},
    ),
    "gauss-seidel": (GaussSeidel(("left", "right")), {}),
    "gauss-seidel backwards": (GaussSeidel(("right", "left")), {}),
    "gauss-seidel linear": (
        GaussSeidel(("left", "right"), extrapolation="linear"),
        {"extrapolation": "linear"},
    ),
    "quasi-newton": (InterfaceQuasiNewton(), {"algorithm": "quasi-newton"}),
    "quasi-newton linear": (
        InterfaceQuasiNewton(interpolation="linear"),
        {"algorithm": "quasi-newton", "interpolation": "linear"},
    ),
}


def measured(
    network: Network, name: str, h: Duration, folder: Path, *, steps: int, bond: Bond = SPRING
) -> tuple[Answer, Recording]:
    algorithm, coupling = COUPLINGS[name]
    system, _ = network.system(h, FOLLOWS)
    turns = algorithm.turns(system)
    manifest = {"scenario": {"coupling": dict(coupling)}, "turns": list(turns)}
    recorder = Recorder(folder, manifest=manifest)
    simulate(system, algorithm, start=0, stop=steps * h, seed=0, observers=[recorder])
    recording = Recording(folder)
    return CouplingEnergy(bonds={"spring": bond}).compute(recording), recording


def pulled(mass: float, spring: float, own: float, start: tuple[float, float, float]) -> Part:
    """A mass on a spring of its own, and a spring whose other end moves with velocity `v`.

    The spring tells its force `f` on that end, the mass its `y`, `w`, and `z` how long it is.
    """
    return Part(
        a=[[0, 1, 0], [-own / mass, 0, spring / mass], [0, -1, 0]],
        b=[[0], [0], [1]],
        c=[[0, 0, -spring], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        d=[[0], [0], [0], [0]],
        start=start,
        inputs=("v",),
        outputs=("f", "y", "w", "z"),
    )


def coupled(left: tuple[float, float], right: tuple[float, float, float]) -> Network:
    """Two masses without damping: mass and own spring of the left one; of the right one, and the
    spring between them."""
    (m, k), (n, own, spring) = left, right
    parts = {
        "left": moved(m, k, 0.0, (0.02, 0.0)),
        "right": pulled(n, spring, own, (0.0, 0.0, 0.02)),
    }
    return Network(parts, ("left.v > right.v", "right.f > left.f"))


def stored(
    recording: Recording, left: tuple[float, float], right: tuple[float, float, float]
) -> Any:
    """The energy of all masses and springs at every communication point [J]."""
    x, v, y, w, z = (
        recording[name].values for name in ("left.x", "left.v", "right.y", "right.w", "right.z")
    )
    (m, k), (n, own, spring) = left, right
    return 0.5 * (m * v**2 + k * x**2 + n * w**2 + own * y**2 + spring * z**2)


SYSTEMS = {
    "two masses": ((1.0, 1.0), (1.0, 5.0, 2.0), nanoseconds("0.02")),
    "quarter car": ((40.0, 150_000.0), (400.0, 0.0, 15_000.0), nanoseconds("0.0005")),
}


@pytest.mark.parametrize("coupling", [each for each in COUPLINGS if each != "quasi-newton linear"])
@pytest.mark.parametrize("name", list(SYSTEMS))
def test_the_residual_is_what_the_subsystems_gained(
    name: str, coupling: str, tmp_path: Path
) -> None:
    """Nothing is damped: all energy beside that of the start comes from the coupling."""
    left, right, h = SYSTEMS[name]
    answer, recording = measured(coupled(left, right), coupling, h, tmp_path, steps=200)
    gained = np.diff(stored(recording, left, right))
    residual = answer.tables["spring"]["residual"]
    np.testing.assert_allclose(residual, gained, rtol=0, atol=0.007 * np.max(np.abs(gained)))
    assert answer.numbers["residual"] == answer.numbers["spring_residual"]
    assert answer.numbers["spring_residual"] == pytest.approx(residual.sum(), rel=1e-12)
    assert answer.numbers["spring_absolute"] == pytest.approx(np.abs(residual).sum(), rel=1e-12)
    power = np.max(np.abs(residual)) / (h / 1e9)
    assert answer.numbers["spring_power"] == pytest.approx(power, rel=1e-12)
    assert answer.tables["spring"]["sum"][-1] == pytest.approx(residual.sum(), rel=1e-12)


def test_ends_that_agree_make_next_to_nothing(tmp_path: Path) -> None:
    left, right, h = SYSTEMS["two masses"]
    network = coupled(left, right)
    sums = [
        measured(network, name, h, tmp_path / name, steps=200)[0].numbers["spring_absolute"]
        for name in ("quasi-newton", "quasi-newton linear")
    ]
    assert sums[0] is not None
    assert sums[1] is not None
    assert 200 * float(sums[1]) < float(sums[0])


def turning() -> Network:
    """Effort cos t and flow sin t, which no input changes."""

    def part(input_: str, output: str, row: list[float]) -> Part:
        return Part(
            a=[[0, -1], [1, 0]],
            b=[[0], [0]],
            c=[row],
            d=[[0]],
            start=(1.0, 0.0),
            inputs=(input_,),
            outputs=(output,),
        )

    parts = {"left": part("f", "v", [0, 1]), "right": part("v", "f", [1, 0])}
    return Network(parts, ("left.v > right.v", "right.f > left.f"))


@pytest.mark.parametrize("gain", [1.0, -2.0])
def test_a_turning_pair_has_a_closed_form(tmp_path: Path, gain: float) -> None:
    """Jacobi: 1 - cos h in every step, of which a straight line between points has h / 2 sin h."""
    h = 0.1
    bond = Bond(effort="right.f", flow="left.v", gain=gain)
    answer, _ = measured(turning(), "jacobi", nanoseconds("0.1"), tmp_path, steps=50, bond=bond)
    residual = answer.tables["spring"]["residual"]
    np.testing.assert_allclose(residual, gain * h / 2 * math.sin(h), rtol=1e-11)
    np.testing.assert_allclose(residual, gain * (1 - math.cos(h)), rtol=h**2 / 11)
    # the bond itself carries cos t sin t
    carried = answer.tables["spring"]["transferred"]
    ends = answer.tables["spring"]["t_ns"] / 1e9
    exact = gain * 0.5 * (np.sin(ends) ** 2 - np.sin(ends - h) ** 2)
    np.testing.assert_allclose(carried, exact, atol=abs(gain) * h**3 / 10)
    assert answer.numbers["spring_transferred"] == pytest.approx(np.abs(carried).sum())


@pytest.mark.parametrize(
    ("name", "wanted"), [("jacobi", 2.0), ("jacobi linear", 4.0), ("gauss-seidel linear", 3.0)]
)
def test_the_residual_of_a_step_has_an_order(name: str, wanted: float, tmp_path: Path) -> None:
    """Of the energies of the turning pair from the third step on, by halving the step."""
    sizes = []
    for k, h in enumerate(("0.1", "0.05")):
        answer, _ = measured(turning(), name, nanoseconds(h), tmp_path / str(k), steps=40)
        sizes.append(float(np.max(np.abs(answer.tables["spring"]["residual"][3:]))))
    assert math.log2(sizes[0] / sizes[1]) == pytest.approx(wanted, abs=0.05)


SCENARIO = """\
schema: 1
title: A bond
time: {stop: 1 s}
coupling: {algorithm: ALGORITHM}
components:
  a: {type: "parts:A", step: 100 ms}
  b: {type: "parts:B", step: STEP}
connections:
  - {from: a.y, to: b.u}
  - {from: b.y, to: a.u}
measures:
  energy: {bonds: {spring: {effort: EFFORT, flow: b.y}}}
"""
PARTS = """\
from tests.orchestrator.packages.remote_units import Follower


class A(Follower):
    pass


class B(Follower):
    pass
"""


def scenario(
    folder: Path, algorithm: str = "jacobi", step: str = "100 ms", effort: str = "a.y"
) -> Path:
    (folder / "parts.py").write_text(PARTS)
    path = folder / "bond.yaml"
    text = SCENARIO.replace("ALGORITHM", algorithm).replace("STEP", step)
    path.write_text(text.replace("EFFORT", effort))
    return path


def test_a_scenario_asks_for_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both ends are equal at all times here, and so is what they take each other to be."""
    assert (
        main(
            [
                "run",
                str(scenario(tmp_path)),
                "--no-figure",
                "--out",
                str(tmp_path / "run"),
                "--quiet",
            ]
        )
        == 0
    )
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert manifest["turns"] == ["a", "b"]
    found = json.loads((tmp_path / "run" / "metrics.json").read_text())["measures"]["energy"]
    assert found["residual"] == pytest.approx(0.0, abs=1e-12)
    assert found["spring_transferred"] > 1.0
    assert (tmp_path / "run" / "measures" / "energy-spring.csv").exists()
    assert "energy: spring_residual" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("effort", "what"),
    [
        ("c.y", "12:37: measures.energy.bonds.spring.effort: `c.y` is no output: there is no"),
        ("b.u", "12:20: measures.energy.bonds.spring: effort and flow are outputs of two"),
    ],
)
def test_check_says_what_is_no_bond(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], effort: str, what: str
) -> None:
    assert main(["check", str(scenario(tmp_path, effort=effort))]) == 2
    assert what in capsys.readouterr().out


@pytest.mark.parametrize(
    ("algorithm", "step", "what"),
    [
        ("adaptive", "100 ms", "the recording does not tell what inputs were between"),
        ("jacobi", "200 ms", "`a.y` and `b.y` have different communication points"),
    ],
)
def test_what_cannot_be_said_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], algorithm: str, step: str, what: str
) -> None:
    path = scenario(tmp_path, algorithm, step)
    assert main(["run", str(path), "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]) != 0
    assert what in capsys.readouterr().err
