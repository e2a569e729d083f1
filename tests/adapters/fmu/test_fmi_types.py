"""What is no usable FMU, and what the importer says about it."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.description import read_description
from adapters.fmi.kind import Kind
from adapters.fmi.unpacked import host_folder
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
MODEL_EXCHANGE = HEAD + (
    '<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t">'
    '<ModelExchange modelIdentifier="m"/><ModelVariables><Float64 name="time" '
    'valueReference="0" causality="independent" variability="continuous"/></ModelVariables>'
    "<ModelStructure/></fmiModelDescription>"
)


def archive(path: Path, **files: str) -> Path:
    with zipfile.ZipFile(path, "w") as target:
        for name, text in files.items():
            target.writestr(name.replace("__", "."), text)
    return path


def refusal(path: Path) -> str:
    with pytest.raises(ComponentTypeError) as caught:
        FmuComponentType(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_a_missing_file(tmp_path: Path) -> None:
    assert "there is no such file" in refusal(tmp_path / "none.fmu")


def test_no_archive(tmp_path: Path) -> None:
    path = tmp_path / "text.fmu"
    path.write_text("hello")
    assert "is no ZIP archive, so no FMU" in refusal(path)


def test_no_description(tmp_path: Path) -> None:
    assert "holds no modelDescription.xml" in refusal(archive(tmp_path / "a.fmu", readme="x"))


def test_no_xml(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.fmu", modelDescription__xml="<fmi")
    assert "modelDescription.xml is no XML" in refusal(path)


def test_fmi_1(tmp_path: Path) -> None:
    text = HEAD + '<fmiModelDescription fmiVersion="1.0"/>'
    path = archive(tmp_path / "a.fmu", modelDescription__xml=text)
    assert "FMI 1.0 is not supported, 2.0 and 3.0 are" in refusal(path)


def test_an_interface_that_is_not_there(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.fmu", modelDescription__xml=MODEL_EXCHANGE)
    assert read_description(path).kind is Kind.MODEL_EXCHANGE
    what = "offers Model Exchange only; export it for Co-Simulation to run it here"
    with pytest.raises(ComponentTypeError, match=what):
        read_description(path, Kind.CO_SIMULATION)


def test_an_invalid_description(tmp_path: Path) -> None:
    text = MODEL_EXCHANGE.replace("<ModelStructure/>", "")
    path = archive(tmp_path / "a.fmu", modelDescription__xml=text)
    assert "modelDescription.xml is invalid" in refusal(path)


def copy_without_binaries(source: Path, path: Path, **more: str) -> Path:
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if not name.startswith("binaries/"):
                new.writestr(name, old.read(name))
        for name, text in more.items():
            new.writestr(name.replace("__", "."), text)
    return path


def test_no_binary_for_this_machine(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    path = copy_without_binaries(fmu("lag"), tmp_path / "a.fmu", **{"binaries/ppc-aix/lag__a": ""})
    text = refusal(path)
    assert "cannot run on this machine" in text
    assert "it has binaries for ppc-aix" in text


def test_a_binary_that_is_damaged(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    """Its header is fine, what follows is missing."""
    with zipfile.ZipFile(fmu("lag")) as good:
        name = next(n for n in good.namelist() if n.startswith(f"binaries/{host_folder(3)}/"))
        head = good.read(name)[:32]
    path = copy_without_binaries(fmu("lag"), tmp_path / "a.fmu")
    with zipfile.ZipFile(path, "a") as target:
        target.writestr(name, head)
    here = Path.cwd()
    component = FmuComponentType(path).create("lag", {})
    with pytest.raises(ComponentTypeError, match="cannot be loaded"):
        component.setup(0, stream(1, "lag"))
    assert Path.cwd() == here


def test_a_binary_of_another_build(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(fmu("lag")) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                start = data.index(b'instantiationToken="') + len(b'instantiationToken="')
                data = data[:start] + b"{other" + data[start + 6 :]
            new.writestr(name, data)
    component = FmuComponentType(path).create("lag", {})
    with pytest.raises(Exception, match=r"the instantiation token is `\{other"):
        component.setup(0, stream(1, "lag"))
