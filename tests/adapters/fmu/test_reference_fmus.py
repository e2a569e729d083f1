"""The Reference FMUs of the Modelica Association against their reference results.

They are not part of this repository. `NLOSIM_REFERENCE_FMUS` names a folder with `2.0/NAME.fmu` and
`3.0/NAME.fmu`, and beside each its `NAME_out.csv`.
"""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import System

FOLDER = os.environ.get("NLOSIM_REFERENCE_FMUS")
MODELS = {
    "BouncingBall": ("h", "v"),
    "Dahlquist": ("x",),
    "Resource": ("y",),
    "Stair": ("counter",),
    "VanDerPol": ("x0", "x1"),
}

pytestmark = pytest.mark.skipif(
    FOLDER is None,
    reason="set NLOSIM_REFERENCE_FMUS to a folder with the built Reference FMUs and their results",
)


def results(path: Path) -> dict[str, list[str]]:
    """The columns of a reference result as text, so that times stay exact."""
    with path.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    return {name: [row[name] for row in rows] for name in rows[0]}


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("name", MODELS)
def test_reference_results_are_met(
    name: str,
    version: str,
    compiled: bool,  # noqa: FBT001  (a parameter)
    tmp_path: Path,
) -> None:
    """At every time of the reference; `Stair` asks for the end at the last, 9 s, of 10 s."""
    folder = Path(FOLDER or "") / version
    expected = results(folder / f"{name}_out.csv")
    times = [round(float(t) * 1e9) for t in expected["time"]]  # some carry rounding errors
    stop = 10_000_000_000 if name == "Stair" else times[-1]
    component = FmuComponentType(folder / f"{name}.fmu").create("unit", {})
    system = System({"unit": component}, {"unit": times[1] - times[0]}, [])
    result = simulate(
        system, Jacobi(), start=times[0], stop=stop, seed=1,
        observers=[Recorder(tmp_path / "run")], compiled=compiled,
    )  # fmt: skip
    assert (result.time, result.early_end is None) == (times[-1], name != "Stair")
    run = Recording(tmp_path / "run")
    for output in MODELS[name]:
        found = [float(run[f"unit.{output}"].at(t)) for t in times]
        wanted = [float(value) for value in expected[output][: len(times)]]
        error = np.abs(np.array(found) - np.array(wanted)).max()
        assert error <= 1e-12, output
