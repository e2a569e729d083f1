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
        "aliases": [],
        "description": "",
    }
    assert "row.scaled: Float64[n_row, 4] [m]" in outcome.text


def test_info_shows_the_items_of_enumerations(fmu: Callable[[str], Path]) -> None:
    outcome = execute("info", str(fmu("table")))
    rows = {v["name"]: v for v in outcome.data["variables"]}
    assert rows["interpolation"]["items"] == {"hold": "1", "linear": "2"}
    assert "sample.colour: Enumeration[n_sample] (1 red, 2 green, 3 blue)" in outcome.text


TYPED2 = """\
<fmiModelDescription fmiVersion="2.0" modelName="typed" guid="1">
  <CoSimulation modelIdentifier="typed"/>
  <TypeDefinitions>
    <SimpleType name="Temperature"><Real unit="K" quantity="T"/></SimpleType>
  </TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="T"><Real declaredType="Temperature" start="288"/></ScalarVariable>
    <ScalarVariable name="t"><Real declaredType="Temperature" unit="degC"/></ScalarVariable>
    <ScalarVariable name="n"><Real/></ScalarVariable>
  </ModelVariables>
</fmiModelDescription>"""

TYPED3 = """\
<fmiModelDescription fmiVersion="3.0" modelName="typed" instantiationToken="1">
  <CoSimulation modelIdentifier="typed"/>
  <TypeDefinitions><Float64Type name="Temperature" unit="K"/></TypeDefinitions>
  <ModelVariables>
    <Float64 name="T" declaredType="Temperature" start="288"><Alias name="T_in"/></Float64>
    <Float64 name="t" declaredType="Temperature" unit="degC"/>
    <Float64 name="n"/>
  </ModelVariables>
</fmiModelDescription>"""


@pytest.mark.parametrize(("text", "also"), [(TYPED2, ""), (TYPED3, ", also `T_in`")])
def test_info_shows_what_the_declared_type_says(tmp_path: Path, text: str, also: str) -> None:
    """FMI 2.0.4, section 2.2.3; FMI 3.0.2, sections 2.4.4 and 2.4.7.5."""
    path = tmp_path / "typed.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    outcome = execute("info", str(path))
    assert [v["unit"] for v in outcome.data["variables"]] == ["K", "degC", "1"]
    assert f"[K] = 288{also}  \n" in f"{outcome.text}\n"


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
