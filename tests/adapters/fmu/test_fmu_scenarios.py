"""Parameters of FMUs in scenario files: names of items, arrays with units, and mistakes."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.reader import Recording

SCENARIO = """\
schema: 1
title: A table
time: {stop: 1 s}
components:
  table:
    fmu: table.fmu
    step: 1 s
    parameters:
      n_sample: 4
      sample.gain: [0 dB, 3 dB, 6, -3 dB]
      sample.colour: [red, green, blue, red]
      interpolation: linear
"""


@pytest.fixture
def scenario(fmu: Callable[[str], Path], tmp_path: Path) -> Path:
    (tmp_path / "table.fmu").write_bytes(fmu("table").read_bytes())
    path = tmp_path / "table.yaml"
    path.write_text(SCENARIO)
    return path


def ran(path: Path, out: Path, *options: str) -> Recording:
    assert main(["run", str(path), "--out", str(out), "--quiet", "--no-figure", *options]) == 0
    return Recording(out)


def test_names_and_arrays_reach_the_fmu(scenario: Path, tmp_path: Path) -> None:
    corner = "components.table.parameters.sample.corner=[1, 2, 3, 4, 5, 6, 7, 8]"
    run = ran(scenario, tmp_path / "run", "--set", corner)
    np.testing.assert_array_equal(run["table.colour"].at(10**9), [1, 2, 3, 1])
    np.testing.assert_array_equal(run["table.corner"].at(10**9), [[1, 2, 3, 4], [5, 6, 7, 8]])
    assert run["table.gain"].at(10**9) == 0.0


def test_one_value_stands_for_all_elements(scenario: Path, tmp_path: Path) -> None:
    gain = "components.table.parameters.sample.gain=[7 dB]"
    run = ran(scenario, tmp_path / "run", "--set", gain)
    assert run["table.gain"].at(10**9) == 7.0
    np.testing.assert_array_equal(run["table.corner"].at(10**9), np.zeros((2, 4)))  # the default


@pytest.mark.parametrize("transport", ["in-process", "loopback"])
def test_the_manifest_repeats_the_run(scenario: Path, tmp_path: Path, transport: str) -> None:
    """The defaults written out fit the size that the scenario chose."""
    scenario.write_text(SCENARIO.replace("      sample.colour: [red, green, blue, red]\n", ""))
    first = ran(scenario, tmp_path / "first", "--set", "components.table.process=true")
    manifest = json.loads((tmp_path / "first" / "manifest.json").read_text())
    parameters = manifest["scenario"]["components"]["table"]["parameters"]
    assert parameters == {
        "n_sample": 4,
        "sample.gain": ["0.0 dB", "3.0 dB", "6.0 dB", "-3.0 dB"],
        "interpolation": "linear",
        "sample.colour": ["green"],
        "sample.corner": [0.0],
    }
    again = tmp_path / "again.yaml"
    again.write_text(json.dumps(manifest["scenario"]))
    second = ran(again, tmp_path / "second", "--transport", transport)
    assert second.fingerprint() == first.fingerprint()


def mistakes() -> Iterator[tuple[str, str, str]]:
    """Old text, new text and message of each entry of `fmu_problems.txt`."""
    text = Path(__file__).with_name("fmu_problems.txt").read_text()
    for block in text.strip().split("\n\n")[1:]:
        old, new, problem = block.split("\n")
        yield old.removeprefix("- "), new.removeprefix("+ "), problem


@pytest.mark.parametrize(("old", "new", "problem"), list(mistakes()))
def test_mistakes_are_located_and_say_what_to_write(
    scenario: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, problem: str
) -> None:
    assert SCENARIO.count(old) == 1
    scenario.write_text(SCENARIO.replace(old, new))
    assert main(["check", str(scenario)]) == 2
    assert capsys.readouterr().out.splitlines() == [f"{scenario}:{problem}"]


def test_components_shows_items_sizes_and_units(
    scenario: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")  # a line each
    path = str(scenario.with_name("table.fmu"))
    assert main(["components", path]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "interpolation hold | linear = hold between samples" in lines
    assert (
        'sample.gain list of number = ["1.0 dB"] -100 .. 100 at 0, 1, 2, ...; n_sample values, or '
        "one for all"
    ) in lines
    assert (
        'sample.colour list of red | green | blue = ["green"] shown as it is; n_sample values, or '
        "one for all"
    ) in lines
    assert main(["components", path, "--json"]) == 0
    data: dict[str, Any] = json.loads(capsys.readouterr().out)["parameters"]
    assert (data["interpolation"]["type"], data["interpolation"]["default"]) == (
        "hold | linear",
        "hold",
    )
    assert (data["sample.gain"]["unit"], data["sample.gain"]["default"]) == ("dB", ["1.0 dB"])
