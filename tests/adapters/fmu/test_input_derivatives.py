"""FMI 2.0: derivatives of inputs and of outputs, on two masses, order by order."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from orchestrator.algorithm.adaptive import Adaptive
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.capabilities import CourseFollowing, OutputSlopes, VariableSteps
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.course import Course
from orchestrator.randomness import stream
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Duration, Time, nanoseconds
from tests.orchestrator.linear_parts import Network, Trace, connections, order, traced
from tests.orchestrator.mechanics import moved, two_masses

H = nanoseconds("0.1")
STEPS = tuple(nanoseconds(text) for text in ("0.05", "0.025", "0.0125"))
LEFT: Mapping[str, Any] = {"start.x": 1.0}
RIGHT: Mapping[str, Any] = {"stiffness": 5.0, "spring": 2.0, "damper": 0.1, "start.x": -1.0}
WIRES = ("left.x > right.xin", "left.v > right.vin", "right.force > left.f")
WIRES_OF_LINEAR = ("left.x > right.x", "left.v > right.v", "right.f > left.f")
HELD: Mapping[str, Any] = {"fmi.input_degree": 0, "fmi.output_slopes": False}


def masses(path: Path, h: Duration, options: Mapping[str, Any]) -> System:
    kind = FmuComponentType(path)
    parts: dict[str, Component] = {
        "left": kind.create("left", {**LEFT, **options}),
        "right": kind.create("right", {**RIGHT, **options}),
    }
    return System(parts, dict.fromkeys(parts, h), connections(WIRES))


def error_of(trace: Trace) -> float:
    exact = two_masses().exact(trace.times)
    pairs = (("left.x", "left.x"), ("right.x", "right.y"))
    return max(
        float(np.max(np.abs(np.array([row[a] for row in trace.rows]) - exact[b]))) for a, b in pairs
    )


def changed(path: Path, folder: Path, old: bytes, new: bytes) -> Path:
    """The FMU with another description."""
    target = folder / path.name
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(target, "w") as copy:
        for name in source.namelist():
            data = source.read(name)
            copy.writestr(name, data.replace(old, new) if name.endswith(".xml") else data)
    return target


@pytest.mark.parametrize(
    ("algorithm", "options", "wanted"),
    [
        (Jacobi(), {}, 1.0),
        (Jacobi(extrapolation="linear"), {}, 2.0),
        (GaussSeidel(extrapolation="linear"), {}, 2.0),
        (GaussSeidel(extrapolation="linear"), {"fmi.output_slopes": False}, 2.0),
        (InterfaceQuasiNewton(interpolation="linear"), {}, 2.0),
        (InterfaceQuasiNewton(interpolation="quadratic"), {}, 3.0),
        (InterfaceQuasiNewton(interpolation="quadratic"), {"fmi.output_slopes": False}, 3.0),
    ],
    ids=str,
)
def test_the_order_is_that_of_the_polynomial(
    mass2: Path, algorithm: CosimulationAlgorithm, options: Mapping[str, Any], wanted: float
) -> None:
    errors = [
        error_of(traced(masses(mass2, h, options), algorithm, nanoseconds("1"))) for h in STEPS
    ]
    assert order(errors, STEPS) == pytest.approx(wanted, abs=0.15)


@pytest.mark.parametrize(
    ("algorithm", "share"),
    [
        (GaussSeidel(extrapolation="quadratic"), 0.55),
        (InterfaceQuasiNewton(interpolation="linear"), 0.8),
        (InterfaceQuasiNewton(interpolation="quadratic"), 0.11),
    ],
    ids=["gauss-seidel", "linear", "quadratic"],
)
def test_fmus_are_nearer_to_the_solution_than_with_the_best_of_the_others(
    mass2: Path, algorithm: CosimulationAlgorithm, share: float
) -> None:
    """Until 10 s; 9.8e-3 is what OMSimulator reaches with extrapolation at the same step."""
    found = traced(masses(mass2, H, {}), algorithm, nanoseconds("10"))
    assert error_of(found) < share * 9.8e-3


def test_what_an_fmu_can_do_is_what_its_description_says(mass2: Path, tmp_path: Path) -> None:
    kinds: tuple[type, ...] = (CourseFollowing, OutputSlopes, VariableSteps)

    def able(path: Path, **options: Any) -> list[bool]:
        made = FmuComponentType(path).create("mass", options)
        return [made.capability(kind) is not None for kind in kinds]

    assert able(mass2) == [True, True, True]
    assert able(mass2, **HELD) == [False, False, True]
    for k, flag in enumerate(
        (
            b'canInterpolateInputs="true"',
            b'maxOutputDerivativeOrder="1"',
            b'canHandleVariableCommunicationStepSize="true"',
        )
    ):
        assert able(changed(mass2, tmp_path, flag, b"")) == [j != k for j in range(3)]


def test_a_free_mass_is_moved_as_the_polynomial_says(mass2: Path) -> None:
    """x'' = 1 + 2 s + 3 s^2 over the first step, 5 over the second, which is told nothing."""
    mass = FmuComponentType(mass2).create("mass", {"stiffness": 0.0})
    follower = mass.capability(CourseFollowing)  # type: ignore[type-abstract]
    assert follower is not None
    assert follower.input_degree == 2
    mass.setup(0, stream(1, "mass"))
    inputs = {"f": np.array(1.0), "xin": np.array(0.0), "vin": np.array(0.0)}
    mass.initialise(inputs)
    follower.follow({"f": Course((np.array(1.0), np.array(0.2), np.array(0.03)))})
    mass.step(inputs, 0, H)
    assert mass.outputs()["v"] == pytest.approx(0.1 + 0.01 + 0.001, abs=1e-14)
    assert mass.outputs()["told"] == 2.0
    mass.step({**inputs, "f": np.array(5.0)}, H, H)
    assert mass.outputs()["v"] == pytest.approx(0.111 + 0.5, abs=1e-14)
    mass.close()


def test_a_step_that_is_made_in_pieces_follows_the_same_polynomial(mass2: Path) -> None:
    """Calls longer than 0.03 s are discarded; the input goes on from where it was."""
    options = {"longest": 0.03, "fmi.smallest_step": 1e-3, "stiffness": 0.0}
    mass = FmuComponentType(mass2).create("mass", options)
    follower = mass.capability(CourseFollowing)  # type: ignore[type-abstract]
    assert follower is not None
    mass.setup(0, stream(1, "mass"))
    inputs = {"f": np.array(1.0), "xin": np.array(0.0), "vin": np.array(0.0)}
    mass.initialise(inputs)
    for k in range(2):
        follower.follow({"f": Course((np.array(1.0), np.array(0.2), np.array(0.03)))})
        mass.step({**inputs, "f": np.array(1.0)}, k * H, H)
        assert mass.outputs()["v"] == pytest.approx(0.111 * (k + 1), abs=1e-13)
    mass.step({**inputs, "f": np.array(5.0)}, 2 * H, H)
    assert mass.outputs()["v"] == pytest.approx(0.222 + 0.5, abs=1e-13)
    mass.close()


def test_an_order_that_the_fmu_refuses_is_an_error_with_a_way_out(mass2: Path) -> None:
    mass = FmuComponentType(mass2).create("mass", {})
    follower = mass.capability(CourseFollowing)  # type: ignore[type-abstract]
    assert follower is not None
    mass.setup(0, stream(1, "mass"))
    inputs = {"f": np.array(1.0), "xin": np.array(0.0), "vin": np.array(0.0)}
    mass.initialise(inputs)
    follower.follow({"f": Course(tuple(np.array(1.0) for _ in range(4)))})
    what = r"of `f` up to order 3 \(`fmi.input_degree: 2` asks for less\) returned Error"
    with pytest.raises(FmuError, match=f"fmi2SetRealInputDerivatives {what}"):
        mass.step(inputs, 0, H)
    mass.close()


def test_slopes_that_the_fmu_does_not_give_are_an_error(mass2: Path) -> None:
    """It gives none before it is initialised."""
    mass = FmuComponentType(mass2).create("mass", {})
    source = mass.capability(OutputSlopes)  # type: ignore[type-abstract]
    assert source is not None
    mass.setup(0, stream(1, "mass"))
    with pytest.raises(FmuError, match="fmi2GetRealOutputDerivatives returned Error"):
        source.slopes()
    mass.close()


@pytest.mark.parametrize("algorithm", [Jacobi(extrapolation="linear"), InterfaceQuasiNewton()])
def test_no_more_is_told_than_is_asked_for(mass2: Path, algorithm: CosimulationAlgorithm) -> None:
    told = traced(masses(mass2, H, {}), algorithm, 2 * H).rows[-1]["left.told"]
    assert told == (1.0 if algorithm.pattern is None and "linear" in str(algorithm) else 0.0)


def test_known_slopes_are_used_from_the_first_step_on(mass2: Path) -> None:
    """The left mass starts with 1 m/s, so that its displacement is no constant."""
    right = two_masses(spring=(2.0, 0.0)).parts["right"]
    network = Network({"left": moved(1.0, 1.0, 0.0, (1.0, 1.0)), "right": right}, WIRES_OF_LINEAR)
    exact = float(network.exact([0.1])["right.y"][0])
    errors = {}
    for slopes in (True, False):
        kind = FmuComponentType(mass2)
        parts: dict[str, Component] = {
            "left": kind.create("left", {**LEFT, "start.v": 1.0, "fmi.output_slopes": slopes}),
            "right": kind.create("right", {**RIGHT, "damper": 0.0}),
        }
        system = System(parts, dict.fromkeys(parts, H), connections(WIRES))
        rows = traced(system, Jacobi(extrapolation="linear"), H).rows
        errors[slopes] = abs(rows[-1]["right.x"] - exact)
    assert 5 * errors[True] < errors[False]


def test_slopes_of_outputs_of_unknown_inputs_are_not_used(mass2: Path) -> None:
    """That of the force would be as if the other mass stood still."""
    errors = []
    for slopes in (True, False):
        options = {"fmi.input_degree": 0, "fmi.output_slopes": slopes}
        system = masses(mass2, H, options)
        errors.append(error_of(traced(system, Jacobi(extrapolation="linear"), 20 * H)))
    assert errors[0] < 1.1 * errors[1]


def test_fmi_3_tells_slopes_of_arrays(slopes3: Path) -> None:
    unit = FmuComponentType(slopes3).create("slopes", {})
    source = unit.capability(OutputSlopes)  # type: ignore[type-abstract]
    assert source is not None
    assert unit.capability(VariableSteps) is None  # it has a fixed internal step
    unit.setup(0, stream(1, "slopes"))
    unit.initialise({})
    unit.step({}, 0, H)
    found = source.slopes()
    np.testing.assert_allclose(np.asarray(found["y"]), [1.0, 0.2])
    assert found["z"] == 3.0
    unit.close()


@pytest.mark.parametrize(
    "algorithm",
    [
        Jacobi(extrapolation="linear"),
        InterfaceQuasiNewton(interpolation="quadratic"),
        Adaptive(relative_tolerance=1e-2, extrapolation="quadratic"),
    ],
    ids=["jacobi", "quasi-newton", "adaptive"],
)
def test_it_is_the_same_in_another_process(mass2: Path, algorithm: CosimulationAlgorithm) -> None:
    here = traced(masses(mass2, H, {}), algorithm, 5 * H).rows
    specs = [
        ComponentSpec(name="left", type=mass2, values=LEFT),
        ComponentSpec(name="right", type=mass2, values=RIGHT),
    ]
    with launch(specs, LoopbackTransport()) as parts:
        system = System(parts, dict.fromkeys(parts, H), connections(WIRES))
        assert traced(system, algorithm, 5 * H).rows == here
    assert here[-1]["left.told"] > 0


def test_rejected_steps_of_fmus_are_taken_back(mass2: Path) -> None:
    """A push of 50 N on the right mass from 0.1 s on: steps that were longer are made again."""

    def final(
        algorithm: CosimulationAlgorithm, h: Duration, since: Time
    ) -> tuple[float, Mapping[str, int]]:
        pushed = FunctionComponent(
            {"f": Connector(causality=Causality.OUTPUT, unit="N")},
            lambda state, _, t: (state, {"f": np.array(50.0 if t >= since else 0.0)}),
        )
        system = masses(mass2, h, {})
        whole = System(
            {"push": pushed, **system.components},
            {"push": H, "left": h, "right": h},
            [*system.connections, *connections(["push.f > right.f"])],
        )
        result = simulate(whole, algorithm, start=0, stop=3 * H, seed=0)
        return float(np.asarray(result.values["right"]["x"])), result.coupling

    algorithm = Adaptive(relative_tolerance=1e-4, extrapolation="quadratic")
    found, counts = final(algorithm, H, 2 * H)  # held over the step that ends there
    last = ("left", "right", "push")
    exact, _ = final(GaussSeidel(last, extrapolation="quadratic"), H // 200, H)
    assert counts["rejected"] > 3
    assert found == pytest.approx(exact, abs=1e-6)


SCENARIO = """\
schema: 1
title: Two masses
time: {stop: 1 s}
coupling: {algorithm: jacobi, extrapolation: HOLD}
components:
  left: {fmu: mass2.fmu, step: 100 ms}
  right: {fmu: mass2.fmu, step: 100 ms, parameters: {OPTION}}
connections:
  - {from: left.x, to: right.xin}
  - {from: left.v, to: right.vin}
  - {from: right.force, to: left.f}
"""


@pytest.mark.parametrize(
    ("said", "then"),
    [
        (("hold", ""), ", as they were 100 ms before"),
        (("linear", "fmi.input_degree: 0"), ", as they were 50 ms before"),
        (("linear", ""), ""),
    ],
)
def test_graph_tells_of_which_time_the_force_is(
    mass2: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    said: tuple[str, str],
    then: str,
) -> None:
    (tmp_path / "mass2.fmu").write_bytes(mass2.read_bytes())
    path = tmp_path / "two.yaml"
    path.write_text(SCENARIO.replace("HOLD", said[0]).replace("OPTION", said[1]))
    assert main(["graph", str(path)]) == 0
    assert f"  right: force depends on vin, xin{then}\n" in capsys.readouterr().out
