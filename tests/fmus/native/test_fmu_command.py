"""`nlosim fmu build|info`."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.native.command import add_command
from orchestrator.cli.outcome import Exit, Outcome
from tests.commands import executed

LAG = Path(__file__).parent.parent / "units" / "lag"


def execute(*words: str) -> Outcome:
    return executed(add_command, "fmu", *words)


def test_build_reports_what_it_made_and_what_it_kept(tmp_path: Path) -> None:
    words = ("build", str(LAG), "--target", "host", "--out", str(tmp_path))
    first, second = execute(*words), execute(*words)
    assert (tmp_path / "lag.fmu").is_file()
    assert [row["new"] for row in first.data["fmus"]] == [True]
    assert [row["new"] for row in second.data["fmus"]] == [False]
    assert second.text == f"{tmp_path / 'lag.fmu'}: up to date"


def test_build_says_what_is_wrong(tmp_path: Path) -> None:
    outcome = execute("build", str(tmp_path / "none"))
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert "there is no unit" in outcome.text


def test_info_shows_the_interface(fmu: Callable[[str], Path]) -> None:
    outcome = execute("info", str(fmu("matrix")))
    assert outcome.data["fmi_version"] == "3.0"
    assert outcome.data["interfaces"] == ["CoSimulation"]
    rows = {v["name"]: v for v in outcome.data["variables"]}
    assert rows["row.value"]["dimensions"] == ["n_row", "4"]
    assert rows["gain"] | {"description": ""} == {
        "name": "gain",
        "causality": "parameter",
        "type": "Float64",
        "dimensions": [],
        "unit": "m",
        "start": "1.0",
        "items": {},
        "description": "",
    }
    assert "row.scaled: Float64[n_row, 4] [m]" in outcome.text


def test_info_shows_the_items_of_enumerations(fmu: Callable[[str], Path]) -> None:
    outcome = execute("info", str(fmu("table")))
    rows = {v["name"]: v for v in outcome.data["variables"]}
    assert rows["interpolation"]["items"] == {"hold": "1", "linear": "2"}
    assert "sample.colour: Enumeration[n_sample] (1 red, 2 green, 3 blue)" in outcome.text


@pytest.mark.parametrize("text", ["no archive", ""])
def test_info_refuses_what_is_no_fmu(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.fmu"
    path.write_text(text)
    outcome = execute("info", str(path))
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert f"{path}: is no FMU" in outcome.text
