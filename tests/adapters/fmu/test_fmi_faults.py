"""FMUs that harm a process of their own: the run ends in order and says which, when and how."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from adapters.fmi.errors import failure
from adapters.fmi.messages import MessageLog
from orchestrator.cli import main
from orchestrator.recording.reader import Recording

SCENARIO = """\
schema: 1
title: A good one and a bad one
time: {stop: 1 s}
components:
  good: {fmu: lag2.fmu, step: 100 ms}
  bad:
    fmu: lag2.fmu
    step: 100 ms
    process: true
    deadline: 500 ms
    memory: 100 MB
    parameters: {fail_at: 350 ms}
"""
NAMED = "component `bad` at t = 0.3 s: "


@pytest.fixture
def scenario(lag2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A scenario with both; afterwards no temporary file may be left, wherever one crashed."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    (tmp_path / "lag2.fmu").write_bytes(lag2.read_bytes())
    path = tmp_path / "two.yaml"
    path.write_text(SCENARIO)
    yield path
    assert list(temporary.iterdir()) == []


def run(scenario: Path, deed: int, *options: str) -> int:
    """The exit code of a run in which the bad one does `deed` of `misbehave.h`."""
    out = str(scenario.with_name("run"))
    change = f"components.bad.parameters.fail_as={deed}"
    return main(
        ["run", str(scenario), "--no-figure", "--out", out, "--quiet", "--set", change, *options]
    )


def recorded_until(scenario: Path) -> list[int]:
    """The last communication point [ns] of the output of each FMU."""
    recording = Recording(scenario.with_name("run"))
    found = []
    for name in ("good.x", "bad.x"):
        series = recording[name]
        assert len(series) == len(series.times)
        assert float(series[len(series) - 1]) == pytest.approx(float(recording["good.x"].at(
            int(series.times[-1]))))  # fmt: skip
        found.append(int(series.times[-1]))
    return found


@pytest.mark.parametrize(
    ("deed", "how"),
    [
        (6, "its process was killed by SIGSEGV"),
        (7, "its process was killed by SIGABRT"),
        (8, "its process exited with code 0"),
        (9, "did not answer within 0.5 s (to `step`); its `deadline` allows no more"),
        (12, "its process exited with code 0"),
        (11, "its process was ended with "),
        (3, "fmi2DoStep returned Error: told to fail as 3 at once"),
    ],
    ids=["crash", "abort", "exit", "loop", "end", "memory", "error"],
)
def test_a_fault_ends_the_run_by_name_and_time(
    scenario: Path,
    capsys: pytest.CaptureFixture[str],
    deed: int,
    how: str,
) -> None:
    """What was recorded until then can be read: four points of each, at 0, 0.1, 0.2 and 0.3 s."""
    patience = () if "deadline" in how else ("--set", "components.bad.deadline=120 s")
    assert run(scenario, deed, *patience) == 3
    assert NAMED + how in capsys.readouterr().err
    assert recorded_until(scenario) == [300_000_000] * 2
    manifest = json.loads((scenario.with_name("run") / "manifest.json").read_text())
    assert (manifest["status"], manifest["transport"]) == ("failed", "local")


def test_a_change_of_directory_stays_in_its_process(scenario: Path) -> None:
    here = Path.cwd()
    assert run(scenario, 10) == 0
    assert Path.cwd() == here
    assert recorded_until(scenario) == [1_000_000_000] * 2


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only there somebody waits")
@pytest.mark.parametrize(
    ("deed", "how"),
    [(6, "was killed by SIGSEGV"), (8, "exited with code 0")],
    ids=["crash", "exit"],
)
def test_in_this_process_it_says_who_was_stepping(scenario: Path, deed: int, how: str) -> None:
    """Compiled code steps both, and notes which one and from when; `process` is not meant here."""
    change = ["--set", f"components.bad.parameters.fail_as={deed}", "--transport", "in-process"]
    done = subprocess.run(
        [sys.executable, "-m", "orchestrator", "run", scenario.name, "--out", "run", *change],
        cwd=scenario.parent,
        env={
            **os.environ,
            "TMPDIR": tempfile.gettempdir(),
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    text = f"crash in process: `bad` was stepping at t = 0.3 s (the process {how})"
    assert text in done.stderr
    assert done.stderr.count("nothing is limited") == 2
    manifest = Recording(scenario.with_name("run")).manifest
    assert (manifest["status"], manifest["error"]) == ("crashed", text)
    if deed == 6:
        assert "Segmentation fault" in (scenario.with_name("run") / "log.txt").read_text()


def test_a_change_of_directory_in_this_process_loses_nothing(
    scenario: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All paths are relative, and the table is written when the run ends."""
    text = (
        SCENARIO + "  table: {type: table-sink, step: 100 ms, parameters: {folder: ., file: t.csv,"
    )
    text += " columns: ['x [V]']}}\nconnections: [{from: bad.x, to: table.x}]\n"
    scenario.write_text(text)
    monkeypatch.chdir(scenario.parent)
    settings = ["--set", "components.bad.parameters.fail_as=10", "--transport", "in-process"]
    assert main(["run", scenario.name, "--no-figure", "--out", "run", *settings]) == 0
    assert Path.cwd() == scenario.parent
    assert recorded_until(scenario) == [1_000_000_000] * 2
    assert len((scenario.parent / "t.csv").read_text().splitlines()) == 12
    assert (scenario.with_name("run") / "metrics.json").is_file()


@pytest.mark.parametrize("is_asked", [False, True])
def test_an_fmu_is_asked_to_log_all_it_can_if_the_scenario_says_so(
    scenario: Path, *, is_asked: bool
) -> None:
    change = ["--set", f"components.good.parameters.fmi.logging={str(is_asked).lower()}"]
    assert run(scenario, 0, "--transport", "in-process", *change) == 0
    log = (scenario.with_name("run") / "log.txt").read_text()
    assert ("nlosim.fmu.good: logAll: it begins" in log) is is_asked
    assert "nlosim.fmu.bad" not in log


def test_the_error_of_an_fmu_that_says_nothing_names_what_would_make_it_speak() -> None:
    ask = ", as it was not asked to; `fmi.logging: true` (`nlosim fmu run --logging`) asks it"
    for is_asked, rest in ((False, ask), (True, "")):
        log = MessageLog("unit", is_asked=is_asked)
        log.receive(0, b"", b"all is well")
        said = str(failure("fmi2DoStep", "Fatal", log))
        assert said == f"fmi2DoStep returned Fatal: the FMU logged no reason{rest}"
    log.receive(3, b"logStatusError", b"the boiler is dry")
    assert str(failure("fmi2DoStep", "Error", log)).endswith("returned Error: the boiler is dry")
