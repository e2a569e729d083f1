"""FMI 3.0: the communication step is a whole multiple of the FMU's fixed internal step."""

import re
import zipfile
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from adapters.fmu_command import add_command
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit
from orchestrator.errors import ScenarioError
from orchestrator.scenario.build import load_scenario
from tests.commands import executed

MS = 1_000_000
SCENARIO = """\
schema: 1
title: A step
time: {stop: 0.6 s}
components:
  unit:
    fmu: unit.fmu
    step: 25 ms
"""


def with_attribute(fmu: Path, folder: Path, said: str) -> Path:
    """A copy of an FMU that says this of its steps and nothing else."""
    path = folder / "unit.fmu"
    old_flag = b'canHandleVariableCommunicationStepSize="true"'
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(old_flag, said.encode()))
    return path


def with_step(ends3: Path, folder: Path, step: str) -> FmuComponentType:
    return FmuComponentType(with_attribute(ends3, folder, f'fixedInternalStepSize="{step}"'))


@pytest.mark.parametrize(
    ("internal", "step", "near"),
    [
        ("0.01", 10 * MS, None),
        ("1e-2", 30 * MS, None),
        ("0.01", 25 * MS, "0.02 s or 0.03 s"),
        ("0.01", 29 * MS, "0.02 s or 0.03 s"),
        ("0.01", 5 * MS, "0.01 s"),
        ("0.01", 10 * MS + 1, "0.01 s or 0.02 s"),
        ("0.00033333333333333333", MS, None),  # a third of a millisecond
        ("0.0003333333", MS, None),
        ("0.000333333", MS, "0.000999999 s or 0.001333332 s"),
    ],
)
def test_the_step_is_a_whole_multiple_to_the_nanosecond(
    ends3: Path, tmp_path: Path, internal: str, step: int, near: str | None
) -> None:
    found = with_step(ends3, tmp_path, internal).step_problem(step)
    if near is None:
        assert found is None
    else:
        assert found is not None
        assert found.endswith(f"(`fixedInternalStepSize`); write {near}")


@pytest.mark.parametrize("internal", ["0", "-0.01", "INF", "NaN"])
def test_what_is_no_positive_number_says_nothing(
    ends3: Path, tmp_path: Path, internal: str
) -> None:
    assert with_step(ends3, tmp_path, internal).step_problem(25 * MS) is None


def test_an_fmu_that_says_nothing_takes_every_step(ends3: Path, lag2: Path) -> None:
    for fmu in (ends3, lag2):
        assert FmuComponentType(fmu).step_problem(1) is None


def test_the_problem_is_at_the_step_in_the_file(ends3: Path, tmp_path: Path) -> None:
    with_step(ends3, tmp_path, "0.01")
    path = tmp_path / "unit.yaml"
    path.write_text(SCENARIO)
    said = (
        f"{path}:7:11: components.unit.step: 25 ms is no whole multiple of the internal step of "
        "the FMU, 0.01 s (`fixedInternalStepSize`); write 0.02 s or 0.03 s"
    )
    with pytest.raises(ScenarioError, match=f"^{re.escape(said)}$"):
        load_scenario(path)
    path.write_text(SCENARIO.replace("25 ms", "20 ms"))
    load_scenario(path)


@pytest.mark.parametrize("version", ["lag2", "ends3"])
@pytest.mark.parametrize("said", ["", 'canHandleVariableCommunicationStepSize="false"'])
def test_an_fmu_that_wants_a_constant_step_runs(
    request: pytest.FixtureRequest, tmp_path: Path, version: str, said: str
) -> None:
    """All steps of a component are equal."""
    with_attribute(request.getfixturevalue(version), tmp_path, said)
    path = tmp_path / "unit.yaml"
    path.write_text(SCENARIO)
    assert main(["run", str(path), "--out", str(tmp_path / "run"), "--quiet", "--no-figure"]) == 0


def test_a_run_of_one_fmu_is_refused_the_same(ends3: Path, tmp_path: Path) -> None:
    path = with_attribute(ends3, tmp_path, 'fixedInternalStepSize="0.02"')
    words = ("fmu", "run", str(path), "--stop-time", "0.6", "--quiet")
    outcome = executed(add_command, *words, "--step", "0.05")
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert (
        "--step 0.05: is no whole multiple of the internal step of the FMU, 0.02 s" in outcome.text
    )
    assert outcome.text.endswith("write 0.04 s or 0.06 s")
    assert executed(add_command, *words, "--step", "0.04").exit_code is Exit.DONE
