"""`nlosim fmu validate`: broken rules of FMUs, each with its line."""

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
from fmpy.model_description import read_model_description

from adapters.fmi.unpacked import host_folder
from adapters.fmi.validation import validate
from adapters.fmi.validation.functions import missing, required
from adapters.fmu_command import add_command
from fmus.native.unit import UNITS
from orchestrator.cli.outcome import Exit, Outcome
from tests.commands import executed

ROOT = Path(__file__).parents[3]
DESCRIPTION = "modelDescription.xml"


def execute(*words: str) -> Outcome:
    return executed(add_command, "fmu", *words)


def altered(fmu: Path, folder: Path, *changes: tuple[str, str]) -> tuple[Path, str]:
    """A copy of an FMU with other text in its description, and that text."""
    out = folder / fmu.name
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(out, "w") as target:
        xml = source.read(DESCRIPTION).decode()
        for before, after in changes:
            assert xml.count(before) >= 1, before
            xml = xml.replace(before, after, 1)
        for name in source.namelist():
            target.writestr(name, xml if name == DESCRIPTION else source.read(name))
    return out, xml


def place(xml: str, text: str) -> tuple[int, int]:
    """Line and column of the first place of a text."""
    before = xml[: xml.index(text)]
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1


@pytest.mark.parametrize("name", ["echo", "lag", "matrix", "mirror", "table"])
def test_test_units_break_no_rule(fmu: Callable[[str], Path], name: str) -> None:
    assert [str(each) for each in validate(fmu(name))] == []


@pytest.mark.parametrize("name", UNITS)
def test_units_that_are_shipped_break_no_rule(name: str) -> None:
    assert [str(each) for each in validate(ROOT / "fmus" / name / f"{name}.fmu")] == []


def test_a_written_fmu_breaks_no_rule(ends3: Path) -> None:
    assert validate(ends3) == []


LAG2 = {
    "a second variable of a name": (
        ('name="x"', 'name="u"'),
        ("the variable `u` is there already, in line ",),
        'name="u" valueReference="3"',
    ),
    "a combination that is not": (
        ('name="fail_at" valueReference="1" causality="parameter" variability="fixed"',
         'name="fail_at" valueReference="1" causality="parameter" variability="continuous"'),
        ("`fail_at` cannot have the causality parameter and the variability continuous",),
        'causality="parameter" variability="continuous"',
    ),
    "an initial that is not": (
        ('initial="calculated">\n      <Real', 'initial="never">\n      <Real'),
        ("never",),
        'initial="never"',
    ),
    "a parameter without start": (
        ('<Real start="1e9" unit="s"/>', '<Real unit="s"/>'),
        ("`fail_at` has no start value, which a parameter needs",),
        '<ScalarVariable name="fail_at"',
    ),
    "a start below its bound": (
        ('<Real start="2" unit="s" min="0.001"/>', '<Real start="2" unit="s" min="3"/>'),
        ("`time_constant`: the start value 2 is below min 3",),
        'start="2" unit="s"',
    ),
    "bounds the wrong way round": (
        ('<Integer start="3" min="0" max="16"/>', '<Integer start="3" min="17" max="16"/>'),
        (
            "`fail_as`: min 17 is greater than max 16",
            "`fail_as`: the start value 3 is below min 17",
        ),
        'min="17"',
    ),
    "a unit that is not defined": (
        ('<Real start="0" unit="V"/>', '<Real start="0" unit="W"/>'),
        ("`u` has the unit `W`, which is not defined",),
        'unit="W"',
    ),
    "a type that is not defined": (
        ('<Enumeration declaredType="Method" start="1" max="5"/>',
         '<Enumeration declaredType="Methods" start="1" max="5"/>'),
        ("`method` has the type `Methods`, which is not defined",),
        'declaredType="Methods"',
    ),
    "two items of one value": (
        ('value="9"', 'value="5"'),
        ("the items `Forward Euler` and `not yet` of the type `Method` have the same value, 5",),
        'value="5"/>\n      </Enum',
    ),
    "an output that is not listed": (
        ('      <Unknown index="9"/>\n      <Unknown index="10" dependencies=""/>',
         '      <Unknown index="10" dependencies=""/>'),
        ("the outputs do not list `flag_out` in line 51",),
        "<ModelStructure>",
    ),
    "an input among the outputs": (
        ('<Unknown index="9"/>', '<Unknown index="9"/>\n      <Unknown index="4"/>'),
        ("the outputs list `u`, which is not an output",),
        'index="4"',
    ),
    "an initial unknown that is missing": (
        ('      <Unknown index="7"/>\n', ""),
        ("the initial unknowns do not list `x` in line 43",),
        "<ModelStructure>",
    ),
    "an index of nothing": (
        ('dependencies="5"', 'dependencies="99"'),
        ("`count_out` depends on 99, which is no variable",),
        'dependencies="99"',
    ),
    "an attribute that is not": (
        ('modelName="lag2"', 'modelName="lag2" colour="red"'),
        ("`colour` of `fmiModelDescription`: the attribute `colour` is not allowed",),
        'colour="red"',
    ),
    "no identifier of C": (
        ('modelIdentifier="lag2"', 'modelIdentifier="lag 2"'),
        ("`lag 2` is no identifier of C",),
        'modelIdentifier="lag 2"',
    ),
    "an empty token": (('guid="{lag2-test}"', 'guid=""'), ("`guid` is empty",), 'guid=""'),
}  # fmt: skip


@pytest.mark.parametrize("what", LAG2)
def test_a_broken_rule_is_told_with_its_place(lag2: Path, tmp_path: Path, what: str) -> None:
    (before, after), said, at = LAG2[what]
    path, xml = altered(lag2, tmp_path, (before, after))
    found = [each for each in validate(path) if not each.is_remark]
    texts = [each.what for each in found]
    assert all(any(wanted in text for text in texts) for wanted in said), texts
    first = next(each for each in found if said[0] in each.what)
    assert first.file == f"lag2.fmu/{DESCRIPTION}"
    assert first.place is not None
    assert (first.place.line, first.place.column) == place(xml, at)
    assert first.rule.startswith("FMI 2.0.4, ")


@pytest.mark.parametrize("what", LAG2)
def test_what_fmpy_refuses_is_refused(lag2: Path, tmp_path: Path, what: str) -> None:
    """FMPy's own validation is the peer."""
    path, _ = altered(lag2, tmp_path, LAG2[what][0])
    try:
        read_model_description(str(path), validate=True)
    except Exception:
        assert any(not each.is_remark for each in validate(path))


def test_all_are_told_at_once(lag2: Path, tmp_path: Path) -> None:
    chosen = ["a unit that is not defined", "a start below its bound", "an index of nothing"]
    path, _ = altered(lag2, tmp_path, *(LAG2[name][0] for name in chosen))
    outcome = execute("validate", str(path))
    assert outcome.exit_code is Exit.NOT_PASSED
    for name in chosen:
        assert LAG2[name][1][0] in outcome.text
    assert outcome.text.endswith(f"{path}: 3 broken rules")
    lines = [row["line"] for row in outcome.data["fmus"][0]["findings"]]
    assert lines == sorted(lines)
    assert len(lines) == 3


THREE = (
    '<Float64 name="three" valueReference="9" causality="parameter" variability="fixed" '
    'start="1 2"><Dimension start="3"/></Float64>'
)
ENDS3 = {
    "two references of one value": (
        ('name="y" valueReference="2"', 'name="y" valueReference="1"'),
        "`y` has the value reference of `ends_at` in line 10, 1",
    ),
    "no independent variable": (
        ('causality="independent" variability="continuous"', 'initial="calculated"'),
        "there is no independent variable",
    ),
    "a length that nothing gives": (
        ('unit="s"\n             initial="calculated" description="the time"/>',
         'unit="s" initial="calculated"><Dimension valueReference="77"/></Float64>'),
        "a dimension of `y` refers to the value reference 77, which no variable has",
    ),
    "a length that is a parameter of another type": (
        ('unit="s"\n             initial="calculated" description="the time"/>',
         'unit="s" initial="calculated"><Dimension valueReference="3"/></Float64>'),
        "a dimension of `y` refers to `kind`, which is neither a structural parameter nor",
    ),
    "a start for other elements": (
        ('<Int32 name="kind"', THREE + '<Int32 name="kind"'),
        "`three` has 2 start values for 3 elements",
    ),
    "a whole number that does not fit": (
        ('start="0" min="0" max="9"', 'start="3000000000"'),
        "`kind`: the start value 3000000000 does not fit Int32",
    ),
    "an experiment that ends before": (
        ('<ModelVariables>', '<DefaultExperiment startTime="2" stopTime="1"/><ModelVariables>'),
        "the default experiment stops at 1, not after its start at 2",
    ),
    "a clock that is none": (
        ('initial="calculated" description="the time"', 'clocks="3"'),
        "`y` belongs to a clock with the value reference 3, which is `kind`, which is no clock",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", ENDS3)
def test_a_broken_rule_of_fmi_3_is_told(ends3: Path, tmp_path: Path, what: str) -> None:
    change, said = ENDS3[what]
    path, _ = altered(ends3, tmp_path, change)
    texts = [each.what for each in validate(path)]
    assert any(said in text for text in texts), texts
    assert all(each.rule.startswith("FMI 3.0.2, ") for each in validate(path))


def test_a_binary_that_exports_less_is_named(ends3: Path, tmp_path: Path) -> None:
    path = tmp_path / "ends3.fmu"
    name = f"binaries/{host_folder(3)}/ends3{fmpy.sharedLibraryExtension}"
    with zipfile.ZipFile(ends3) as source, zipfile.ZipFile(path, "w") as target:
        target.writestr(DESCRIPTION, source.read(DESCRIPTION))
        binary = source.read(name)
        assert missing(binary, 3, ["CoSimulation"]) == ()
        target.writestr(
            name, binary.replace(b"fmi3GetAdjointDerivative", b"fmi3GotAdjointDerivative")
        )
        target.writestr("binaries/aarch64-other/ends3.so", binary[:100])
        target.writestr("binaries/aarch64-other/ends3.pdb", b"debugging")
    cut, finding = validate(path)
    assert finding.file == f"ends3.fmu/{name}"
    assert finding.what == "does not export `fmi3GetAdjointDerivative`"
    assert cut.file == "ends3.fmu/binaries/aarch64-other/ends3.so"
    assert cut.what.startswith("cannot be told what it exports: its table of exported functions is")


@pytest.mark.parametrize(
    ("folder", "machine", "said"),
    [
        ("aarch64-darwin", 62, "is ELF for x86_64, in a folder for Mach-O for aarch64"),
        ("aarch64-linux", 62, "is ELF for x86_64, in a folder for ELF for aarch64"),
        ("x86-linux", 0, "is no shared library, in a folder for ELF for x86"),
        ("aarch64-linux", 183, None),
        ("amiga", 183, None),
    ],
)
@pytest.mark.skipif(host_folder(3) != "x86_64-linux", reason="takes the ELF library of this host")
def test_a_binary_for_another_platform_than_its_folder_is_named(
    ends3: Path, tmp_path: Path, folder: str, machine: int, said: str | None
) -> None:
    """A folder that the standard does not name is anybody's."""
    path = tmp_path / "ends3.fmu"
    path.write_bytes(ends3.read_bytes())
    name = f"binaries/{folder}/ends3.{'dylib' if 'darwin' in folder else 'so'}"
    with zipfile.ZipFile(path, "a") as archive:
        elf = archive.read("binaries/x86_64-linux/ends3.so")
        other = elf[:18] + struct.pack("<H", machine) + elf[20:]
        archive.writestr(name, other if machine else b"nothing")
    found = [(each.file, each.what) for each in validate(path)]
    assert found == ([] if said is None else [(f"ends3.fmu/{name}", said)])


def test_a_binary_that_this_machine_cannot_load_is_remarked_upon(
    ends3: Path, tmp_path: Path
) -> None:
    path = tmp_path / "ends3.fmu"
    name = f"binaries/{host_folder(3)}/ends3{fmpy.sharedLibraryExtension}"
    with zipfile.ZipFile(ends3) as source, zipfile.ZipFile(path, "w") as target:
        target.writestr(DESCRIPTION, source.read(DESCRIPTION))
        target.writestr(name, b"no library")
    misplaced, remark = sorted(validate(path), key=lambda each: each.is_remark)
    assert misplaced.what.startswith("is no shared library, in a folder for ")
    assert remark.what == f"cannot run on this machine: `{name}` is no shared library"


def test_as_many_functions_are_asked_for_as_the_headers_of_the_standard_have() -> None:
    """All function types of fmi2FunctionTypes.h and fmi3FunctionTypes.h."""
    assert len(required(2, ["ModelExchange", "CoSimulation"])) == 44
    assert len(required(3, ["ModelExchange", "CoSimulation", "ScheduledExecution"])) == 75


@pytest.mark.parametrize(
    ("name", "flags", "said"),
    [
        ("../out.txt", 0, "`../out.txt` leaves the folder it is unpacked to"),
        ("/etc/out.txt", 0, "`/etc/out.txt` is an absolute name"),
        (
            "resources\\out.txt",
            0,
            "`resources\\out.txt` has a character that names in an FMU cannot have",
        ),
        ("resources/link", 0o120777 << 16, "`resources/link` is a link or a device, no file"),
    ],
)
def test_an_archive_that_reaches_out_is_refused(
    ends3: Path, tmp_path: Path, name: str, flags: int, said: str
) -> None:
    path = tmp_path / "ends3.fmu"
    path.write_bytes(ends3.read_bytes())
    entry = zipfile.ZipInfo(name)
    entry.external_attr = flags
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(entry, "target")
    assert [each.what for each in validate(path)] == [said]


def test_what_is_no_fmu_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"
    path.write_text("no archive")
    assert "is no ZIP archive" in validate(path)[0].what
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "")
    assert "has no `modelDescription.xml`" in validate(path)[0].what
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(DESCRIPTION, "<fmiModelDescription>\n  <Model\n")
    (finding,) = validate(path)
    assert (finding.file, finding.what[:9]) == (f"a.fmu/{DESCRIPTION}", "is no XML")
    assert finding.place is not None
    assert finding.place.line in {2, 3}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(DESCRIPTION, '<fmiModelDescription fmiVersion="1.0"/>')
    assert "`fmiVersion` is '1.0': neither FMI 2.0 nor 3.0" in validate(path)[0].what
    assert execute("validate", str(tmp_path / "none.fmu")).exit_code is Exit.WRONG_INPUT


def test_what_its_schema_cannot_be_asked_about_is_told(
    fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    """libxml2 gives up on entities that are not replaced."""
    start = "<fmiModelDescription"
    declared = f'<!DOCTYPE fmiModelDescription [<!ENTITY e SYSTEM "file:///x">]>{start}'
    path, _ = altered(
        fmu("lag"), tmp_path, (start, declared), ("<ModelVariables>", "<ModelVariables>&e;")
    )
    told = [each.what for each in validate(path)]
    assert any(what.startswith("cannot be compared with its schema: ") for what in told)


@pytest.mark.parametrize(
    ("name", "rule"), [("lag2", "FMI 2.0.4, 2.3"), ("ends3", "FMI 3.0.2, 2.5")]
)
def test_an_archive_without_a_program_breaks_the_rule_about_archives(
    name: str, rule: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    whole: Path = request.getfixturevalue(name)
    path = tmp_path / whole.name
    with zipfile.ZipFile(whole) as source, zipfile.ZipFile(path, "w") as target:
        target.writestr(DESCRIPTION, source.read(DESCRIPTION))
    said = f"has neither a binary `{name}` nor sources"
    assert [each.rule for each in validate(path) if each.what == said] == [rule]


def test_a_start_value_that_is_no_number_hides_no_other(
    fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    path, _ = altered(fmu("matrix"), tmp_path, ('start="0.5', 'max="1" start="nought 2'))
    texts = [each.what for each in validate(path)]
    assert "`row.value`: the start value 2 is above max 1" in texts, texts
