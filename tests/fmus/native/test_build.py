"""From the table of variables to an archive: complete, valid, and the same bytes every time."""

import dataclasses
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import fmpy
import fmpy.build
import pytest
from fmpy.validation import validate_fmu

from fmus.native.build import build_fmu, main
from fmus.native.check import InterfaceError, check_interface
from fmus.native.interface import Interface, Variable, choice
from fmus.native.targets import TARGETS, CompilerError, host_platform, select_targets
from fmus.native.unit import UNITS, Unit, load_unit

TEST_UNITS = Path(__file__).parent.parent / "units"
HOST = select_targets(["host"])


def built(unit: Unit, out: Path) -> bytes:
    return build_fmu(unit, out, targets=HOST, force=True).path.read_bytes()


@pytest.mark.parametrize("name", ["matrix", "echo", "lag", "faulty", "table"])
def test_fmpy_finds_nothing_wrong(fmu: Callable[[str], Path], name: str) -> None:
    assert validate_fmu(str(fmu(name))) == []


@pytest.mark.parametrize("name", UNITS)
def test_fmpy_finds_nothing_wrong_with_our_units(name: str, tmp_path: Path) -> None:
    unit = load_unit(name)
    path = build_fmu(unit, tmp_path, targets=()).path
    assert validate_fmu(str(path)) == []


def test_the_same_sources_give_the_same_bytes_wherever_they_are(tmp_path: Path) -> None:
    unit = load_unit(str(TEST_UNITS / "lag"))
    elsewhere = tmp_path / "else" / "where" / "lag"
    shutil.copytree(unit.folder, elsewhere)
    other = load_unit(str(elsewhere))
    assert built(unit, tmp_path / "a") == built(other, tmp_path / "b")


def test_line_ends_do_not_matter_and_contents_do(tmp_path: Path) -> None:
    unit = load_unit(str(TEST_UNITS / "lag"))
    copy = Unit(interface=unit.interface, folder=tmp_path)
    source = (unit.folder / "lag.c").read_bytes()
    (tmp_path / "lag.c").write_bytes(source.replace(b"\n", b"\r\n"))
    assert copy.token() == unit.token()
    (tmp_path / "lag.c").write_bytes(source + b"\n")
    assert copy.token() != unit.token()
    renamed = dataclasses.replace(unit.interface, description="Something else")
    assert Unit(interface=renamed, folder=unit.folder).token() != (unit.token())


def test_an_fmu_that_is_up_to_date_is_kept(tmp_path: Path) -> None:
    unit = load_unit(str(TEST_UNITS / "lag"))
    assert build_fmu(unit, tmp_path, targets=HOST).is_new
    assert not build_fmu(unit, tmp_path, targets=HOST).is_new
    assert build_fmu(unit, tmp_path, targets=()).is_new  # other platforms


def test_the_archive_is_complete(fmu: Callable[[str], Path]) -> None:
    with zipfile.ZipFile(fmu("lag")) as archive:
        names = set(archive.namelist())
        texts = {name: archive.read(name) for name in names}
    assert names >= {
        "modelDescription.xml",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "sources/buildDescription.xml",
        "sources/variables.c",
        "sources/variables.h",
        "sources/lag.c",
        "sources/fmi3_shell.c",
        "sources/fmi3_model.h",
    }
    assert any(name.startswith(f"binaries/{host_platform()}/lag.") for name in names)
    for name, data in texts.items():
        assert str(TEST_UNITS).encode() not in data, name
        assert b"nlosim-fmu-" not in data, name


def test_an_enumeration_and_its_type_are_described(fmu: Callable[[str], Path]) -> None:
    with zipfile.ZipFile(fmu("table")) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))  # noqa: S314
    order = [element.tag for element in root]
    assert order.index("UnitDefinitions") < order.index("TypeDefinitions")
    assert order.index("TypeDefinitions") < order.index("LogCategories")
    types = {kind.get("name"): [dict(i.attrib) for i in kind] for kind in root[2]}
    assert types["interpolation.item"] == [
        {"name": "hold", "value": "1"},
        {"name": "linear", "value": "2"},
    ]
    variable = root.find("ModelVariables/Enumeration[@name='interpolation']")
    assert variable is not None
    attributes = ("declaredType", "start", "min", "max")
    assert [variable.get(a) for a in attributes] == ["interpolation.item", "1", "1", "2"]


def test_linux_binaries_run_on_glibc_2_17(fmu: Callable[[str], Path]) -> None:
    if host_platform() != "x86_64-linux":
        pytest.skip("no Linux binary was built here")
    with zipfile.ZipFile(fmu("lag")) as archive:
        data = archive.read("binaries/x86_64-linux/lag.so")
    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_([0-9.]+)", data)}
    assert versions
    assert max(versions) <= (2, 17)


@pytest.mark.slow
def test_the_sources_compile_without_us(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    if shutil.which("cmake") is None or shutil.which("cc") is None:
        pytest.skip("needs CMake and a system compiler")
    fmpy.extract(str(fmu("lag")), str(tmp_path))
    library = next((tmp_path / "binaries" / host_platform()).iterdir())
    library.unlink()
    (tmp_path / "cmake").mkdir()
    fmpy.build.build_platform_binary(tmp_path, build_dir=tmp_path / "cmake")
    assert library.is_file()


def variable(name: str = "x", **changes: Any) -> Variable:
    usual: dict[str, Any] = {
        "type": "Float64",
        "causality": "parameter",
        "variability": "fixed",
        "description": "",
    }
    return Variable(name=name, **(usual | changes))


SIZE = {"type": "UInt64", "causality": "structuralParameter"}
COLOURS: dict[str, Any] = {"type": "Enumeration", "items": ("red", "blue")}
OUTPUT = {"causality": "output", "variability": "discrete"}


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ([variable("a b")], "`a b` is no structured name"),
        ([variable(), variable()], "`x` is declared twice"),
        ([variable("time")], "`time` is declared twice"),
        ([variable("a.b"), variable("a_b")], "two variables are called `VR_a_b` in C"),
        ([variable(unit="furlong")], "has the unit `furlong`, which"),
        ([variable(type="Int32", unit="m")], "FMI 3.0 has units for Float32 and Float64 only"),
        ([variable(variability="discrete")], "is parameter and cannot be discrete"),
        ([variable(start=2, maximum=1)], "starts at 2, outside"),
        ([variable(type="UInt8", start=256)], "has the start 256, which UInt8 cannot hold"),
        ([variable(type="UInt8", start=-1)], "has the start -1, which UInt8 cannot hold"),
        ([variable(type="Int32", start=0.5)], "has the start 0.5, which is no integer"),
        ([variable(type="Boolean", minimum=0)], "is Boolean and has no bounds"),
        ([variable(type="Binary")], "is Binary and cannot be a parameter"),
        ([variable(type="Enumeration")], "is an Enumeration without items"),
        ([variable(items=("a",))], "is Float64 and has no items"),
        ([choice("x", ("a", "b", "a"), "")], "has the item `a` twice"),
        ([choice("x", ("two-ray",), "")], "has the item `two-ray`; write a word in lower case"),
        ([choice("x", ("null",), "")], "has the item `null`; write a word in lower case"),
        ([variable(**COLOURS, start=0)], "starts at 0; its items are 1 to 2"),
        ([variable(**COLOURS, start=3)], "starts at 3; its items are 1 to 2"),
        ([variable(**COLOURS, maximum=2, start=1)], "is Enumeration and has no bounds"),
        ([choice("x", ("a",), ""), variable("x.item")], "`x.item` is declared twice"),
        ([variable(dimensions=("n",))], "has the axis `n`, which is no structural parameter"),
        ([variable(dimensions=(0,))], "has an axis of length 0"),
        ([variable(dimensions=(1, 1, 1, 1, 1))], "has more than 4 dimensions"),
        ([variable("n", **SIZE)], "must start at 1 or more"),
        ([variable("n", **SIZE | {"type": "Int32"})], "must be a scalar UInt64"),
        ([variable(dependencies=("x",))], "is parameter and has no dependencies"),
        ([variable(dependencies=("u",), **OUTPUT)], "depends on `u`, which is no input"),
        ([variable(type="Int8", **OUTPUT | {"variability": "continuous"})], "cannot be continuous"),
    ],
)
def test_wrong_tables_are_refused(variables: list[Variable], message: str) -> None:
    interface = Interface(
        name="unit", description="", variables=tuple(variables), sources=("unit.c",)
    )
    with pytest.raises(InterfaceError, match=re.escape(message)):
        check_interface(interface)


def test_all_problems_are_reported_at_once() -> None:
    interface = Interface(
        name="not c",
        description="",
        variables=(variable(unit="x"), variable("y", unit="x")),
        sources=(),
    )
    with pytest.raises(InterfaceError) as caught:
        check_interface(interface)
    assert len(str(caught.value).splitlines()) == 3


def test_a_unit_without_interface_is_refused(tmp_path: Path, capsys: Any) -> None:
    assert main([str(tmp_path)]) == 2
    assert "there is no unit" in capsys.readouterr().err


def test_a_missing_source_is_named(tmp_path: Path) -> None:
    unit = Unit(interface=load_unit(str(TEST_UNITS / "lag")).interface, folder=tmp_path)
    with pytest.raises(InterfaceError, match=r"lag\.c is missing"):
        build_fmu(unit, tmp_path, targets=HOST)


def test_the_compiler_says_what_it_does_not_like(tmp_path: Path) -> None:
    interface = load_unit(str(TEST_UNITS / "lag")).interface
    (tmp_path / "lag.c").write_text("#include <no_such_header.h>\n")
    with pytest.raises(CompilerError, match=r"no_such_header\.h"):
        build_fmu(Unit(interface=interface, folder=tmp_path), tmp_path, targets=HOST)
    assert list(tmp_path.glob("*.fmu*")) == []


def test_an_unknown_target_is_refused() -> None:
    with pytest.raises(CompilerError, match=r"no target `sparc`; there are aarch64-darwin"):
        select_targets(["sparc"])


def test_other_compilers_compile_for_this_host_only(tmp_path: Path) -> None:
    other = tuple(t for t in TARGETS if t.platform != host_platform())[:1]
    with pytest.raises(CompilerError, match=r"compiles for this host, not for"):
        build_fmu(load_unit(str(TEST_UNITS / "lag")), tmp_path, targets=other, cc=["true"])


def test_a_compiler_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(CompilerError, match=r"`no-such-cc --version` does not run"):
        build_fmu(load_unit(str(TEST_UNITS / "lag")), tmp_path, targets=HOST, cc=["no-such-cc"])


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_of_measurement_has_a_factor_only_if_it_is_no_product_of_base_units(
    name: str, tmp_path: Path
) -> None:
    path = build_fmu(load_unit(name), tmp_path, targets=()).path
    with zipfile.ZipFile(path) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))  # noqa: S314 - our own
    factors = {unit.get("name"): unit[0].get("factor") for unit in root.iter("Unit") if len(unit)}
    assert factors["s"] is None
    assert all(factor is None or float(factor) != 1.0 for factor in factors.values())
