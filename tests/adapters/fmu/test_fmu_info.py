"""`nlosim fmu info`."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmu_command import add_command
from orchestrator.cli.outcome import Exit, Outcome
from tests.commands import executed


def execute(*words: str) -> Outcome:
    return executed(add_command, "fmu", *words)


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


@pytest.mark.parametrize("encoding", ["nowhere", "utf-7"])
def test_an_encoding_that_is_none_is_told(
    fmu: Callable[[str], Path], tmp_path: Path, encoding: str
) -> None:
    """Python's parser raises other errors for it than for text that is no XML."""
    head = f'<?xml version="1.0" encoding="{encoding}"?>'.encode()
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", head + b"<fmiModelDescription/>")
    outcome = execute("info", str(path))
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert f"{path}: is no FMU: modelDescription.xml is no XML: " in outcome.text
