"""FMUs of which a process can have one instance: refused before a run, fine in two processes."""

import zipfile
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.recording.reader import Recording
from orchestrator.scenario.build import load_scenario

SCENARIO = """\
schema: 1
title: Two of one FMU
time: {stop: 0.2 s}
components:
  one: {fmu: one.fmu, step: 100 ms}
  other: {fmu: copy.fmu, step: 100 ms}
"""


def with_flag(fmu: Path, path: Path, value: str) -> Path:
    """A copy of an FMU that says whether it can be instantiated only once per process."""
    flag = f'<CoSimulation canBeInstantiatedOnlyOncePerProcess="{value}"'.encode()
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"<CoSimulation", flag))
    return path


@pytest.fixture(params=["lag2", "ends3"])
def scenario(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Two components that are copies of one FMU, of FMI 2.0 and 3.0."""
    original: Path = request.getfixturevalue(request.param)
    with_flag(original, tmp_path / "one.fmu", "true")
    with_flag(original, tmp_path / "copy.fmu", "1")
    path = tmp_path / "two.yaml"
    path.write_text(SCENARIO)
    return path


def test_the_second_instance_is_refused_at_its_line(scenario: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        load_scenario(scenario)
    (problem,) = error.value.problems
    name = "lag2" if "lag2" in problem.what else "ends3"
    assert str(problem) == (
        f"{scenario}:6:3: components.other: the FMU `{name}` {{{name}-test}} can be in a process "
        "once, and it is in `one`; write `process: true` here"
    )


def test_fmus_that_do_not_say_so_share_a_process(scenario: Path, ends3: Path) -> None:
    with_flag(ends3, scenario.with_name("copy.fmu"), "false")
    assert FmuComponentType(scenario.with_name("copy.fmu")).once_per_process({}) is None
    assert FmuComponentType(ends3).once_per_process({}) is None
    load_scenario(scenario)


def test_another_fmu_that_says_so_is_no_obstacle(scenario: Path, lag2: Path, ends3: Path) -> None:
    with_flag(lag2, scenario.with_name("one.fmu"), "true")
    with_flag(ends3, scenario.with_name("copy.fmu"), "true")
    load_scenario(scenario)


def test_in_another_process_it_runs(scenario: Path) -> None:
    scenario.write_text(SCENARIO.replace("copy.fmu,", "copy.fmu, process: true,"))
    out = scenario.with_name("run")
    command = ["run", str(scenario), "--out", str(out), "--quiet", "--no-figure"]
    assert main([*command, "--transport", "in-process"]) == 2
    assert main(command) == 0
    connectors = FmuComponentType(scenario.with_name("one.fmu")).create("one", {}).connectors
    output = "x" if "x" in connectors else "y"
    one, other = (Recording(out)[f"{name}.{output}"] for name in ("one", "other"))
    assert one.times[-1] == other.times[-1] == 200_000_000
