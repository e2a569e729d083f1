"""What may be in a package, and in which files."""

import io
import json
import zipfile
from pathlib import Path

import pytest

from adapters.ssp.importing import import_package
from adapters.ssp.writing import unit
from orchestrator.errors import ScenarioError
from orchestrator.units import parse_unit
from tests.adapters.ssp.packages import (
    PLANT,
    component,
    connectors,
    description,
    link,
    package,
    system,
    values,
)
from tests.adapters.ssp.test_import import LINEAR, imported, problems, scenario
from tests.adapters.ssp.test_values import bound

WHEEL = system(
    "wheel", component("hub", "u", "y"), ports=connectors("speed:input", "out:output"),
    values=values("hub.k:Real:1", "hub.warm:Real:1"),
    links=link(".speed", "hub.u") + link("hub.y", ".out"),
)  # fmt: skip


def car(type_: str, source: str) -> str:
    """A component that stands for a wheel, with a value of its own."""
    wheel = component("front", "speed:input", "out:output", source=source,
                      inside=bound(values("hub.k:Real:2")))  # fmt: skip
    wheel = wheel.replace(" source", f' type="application/{type_}" source')
    return system(
        "car", component("motor", "y"), wheel, links=link("motor.y", "front.speed", LINEAR)
    )


def inner(content: str, name: str = "SystemStructure.ssd") -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(name, content)
        archive.writestr("resources/plant.fmu", PLANT)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("type_", "source", "files", "fmu"),
    [
        ("x-ssp-definition", "wheel.ssd", {"wheel.ssd": description(WHEEL)}, "resources/plant.fmu"),
        (
            "x-ssp-package", "resources/wheel.ssp",
            {"resources/wheel.ssp": inner(description(WHEEL))},
            "resources/wheel.ssp/resources/plant.fmu",
        ),
        (
            "x-ssp-package", "resources/wheel.ssp#Other.ssd",
            {"resources/wheel.ssp": inner(description(WHEEL), "Other.ssd")},
            "resources/wheel.ssp/resources/plant.fmu",
        ),
        ("x-ssp-definition", "#round", {}, "resources/plant.fmu"),
    ],
)  # fmt: skip
def test_a_component_may_be_another_system(
    tmp_path: Path, type_: str, source: str, files: dict[str, str | bytes], fmu: str
) -> None:
    """SSP 2.0, 5.3.2: its values come after all of the system that it stands for."""
    content = car(type_, source)
    if source.startswith("#"):
        embedded = WHEEL.replace(' name="wheel"', ' name="spare" id="round"')
        content = content.replace("</ssd:Elements><ssd:Conn", f"{embedded}</ssd:Elements><ssd:Conn")
    found = scenario(imported(tmp_path, description(content), files))
    hub = found["components"]["front-hub"]
    assert hub["fmu"] == fmu
    assert (tmp_path / "out" / fmu).read_bytes() == PLANT
    assert hub["parameters"] == {"k": 2.0, "warm": 1.0}
    assert found["connections"] == [
        {"from": "motor.y", "to": "front-hub.u", "gain": 2.0, "offset": 0.5}
    ]


@pytest.mark.parametrize("variant", ["Winter.ssd", "Cold"])
def test_another_variant_is_chosen_by_its_file_or_its_name(tmp_path: Path, variant: str) -> None:
    files = {"Winter.ssd": description(system("w", component("b")), name="Cold")}
    found = imported(tmp_path, description(system("t", component("a"))), files, variant=variant)
    assert list(scenario(found)["components"]) == ["b"]
    assert scenario(found)["title"] == "Cold"


def test_a_variant_that_is_not_there_is_told_with_those_that_are(tmp_path: Path) -> None:
    content = description(system("t", component("a")))
    (found,) = problems(tmp_path, content, variant="Hot")
    assert found.endswith("there is no variant `Hot`; there are: test")


@pytest.mark.parametrize(
    ("files", "problem"),
    [
        ({"../evil": b""}, "`../evil` leaves the folder it is unpacked to"),
        ({"/etc/evil": b""}, "`/etc/evil` is an absolute name"),
    ],
)
def test_archives_that_would_do_harm_are_refused(
    tmp_path: Path, files: dict[str, bytes], problem: str
) -> None:
    content = description(system("t", component("a")))
    (found,) = problems(tmp_path, content, files)
    assert problem in found


def test_a_package_within_a_package_is_held_to_the_same(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("../evil", b"")
    files = {"resources/wheel.ssp": buffer.getvalue()}
    content = description(car("x-ssp-package", "resources/wheel.ssp"))
    (found,) = problems(tmp_path, content, files)
    assert found.startswith("test.ssp/resources/wheel.ssp:1:1: is refused: `../evil` leaves")


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("<ssd:System", ":1:1: is no XML: unclosed token"),
        ('<?xml version="1.0" encoding="x.y"?><a/>', ":1:1: is no XML: unknown encoding: x.y"),
        ('<?xml version="1.0" encoding="shift_jis"?><a/>', ":1:1: is no XML: multi-byte encodings"),
        ("<a/>", ":1:1: expected `ssd:SystemStructureDescription` of SSP 1.0 or 2.0, got `a`"),
        (
            "<ssd:SystemStructureDescription/>",
            "got `ssd:SystemStructureDescription`, whose prefix does not stand for http://ssp-st",
        ),
        (
            description(system("t", component("a"))).replace("SSP1/SystemS", "SSP9/SystemS"),
            "got `ssd:SystemStructureDescription`, whose prefix does not stand for http://ssp-st",
        ),
        (
            description(system("t", component("a")), version="3.0"),
            "SSP `3.0` is not supported, 1.0 and 2.0 are",
        ),
        (
            description(system("t", component("a"))).replace('stopTime="2"', 'stopTime="0"'),
            "stops at 0.0 s, and starts at 0.0 s",
        ),
        (
            description(system("t", component("a"))).replace('stopTime="2"', 'stopTime="1e-10"'),
            "1e-10 s is not a whole number of nanoseconds",
        ),
        (
            description(system("t", component("a"))).replace('m="1" s="-1"/>', 'm="x"/>'),
            "`m`: expected a number, got `x`",
        ),
        (
            description(car("x-ssp-definition", "SystemStructure.ssd")),
            "`SystemStructure.ssd` contains itself",
        ),
        (description(car("x-ssp-definition", "#x")), "no system here has the id `x`"),
        (description(car("x-ssp-definition", "car.ssd")), "`car.ssd` contains itself"),
        (
            description(system("t", "<ssd:System name='x'>" * 60 + "</ssd:System>" * 60)),
            "`ssd:System` has no element `ssd:System`",
        ),
        ("<a>" * 300 + "</a>" * 300, "elements are nested more than 200 deep"),
    ],
)  # fmt: skip
def test_what_is_no_description_is_told(tmp_path: Path, content: str, problem: str) -> None:
    found = problems(tmp_path, content, {"car.ssd": content})
    assert any(problem in each for each in found), found


def test_there_must_be_a_main_description(tmp_path: Path) -> None:
    path = package(tmp_path, description(system("t", component("a"))))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("Other.ssd", "")

    with pytest.raises(ScenarioError, match=r"there is no `SystemStructure.ssd` at the top"):
        import_package(path, tmp_path / "out")
    with pytest.raises(ScenarioError, match="there is no such file"):
        import_package(tmp_path / "none.ssp", tmp_path / "out")
    path.write_bytes(b"no archive")
    with pytest.raises(ScenarioError, match="is no ZIP archive, so no SSP"):
        import_package(path, tmp_path / "out")


def test_a_folder_with_something_in_it_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/kept").touch()

    with pytest.raises(ScenarioError, match="choose another folder"):
        imported(tmp_path, description(system("t", component("a"))))
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["kept"]
    assert not list(tmp_path.glob(".out-*"))


def test_notes_of_nlosim_that_are_wrong_are_told(tmp_path: Path) -> None:
    note = (
        '<ssd:Annotations><ssc:Annotation type="io.github.nlosim">'
        '<x step="5 m" parameters="{" /></ssc:Annotation></ssd:Annotations>'
    )
    found = problems(tmp_path, description(system("t", component("a", inside=note))))
    assert "`parameters` of a note of nlosim: Expecting property name" in found[0]
    assert found[1].endswith("`step` of a note of nlosim: expected a time (s), got a length (m)")


def test_annotations_of_others_are_not_taken_for_notes(tmp_path: Path) -> None:
    note = (
        '<ssd:Annotations><ssc:Annotation type="com.example">'
        '<x step="3 s" parameters="{" /></ssc:Annotation></ssd:Annotations>'
    )
    found = imported(tmp_path, description(system("t", component("a", inside=note))))
    assert "3 s" not in json.dumps(scenario(found))


def test_systems_that_multiply_are_refused(tmp_path: Path) -> None:
    """Ten components, each of which stands for ten, and so on."""

    def level(number: int) -> str:
        inner = f' type="application/x-ssp-definition" source="#s{number + 1}" '
        ten = "".join(f'<ssd:Component name="c{k}"{inner}/>' for k in range(10))
        found = system(f"s{number}", ten if number < 9 else component("a"))
        return found.replace(f'name="s{number}"', f'name="s{number}" id="s{number}"')

    found = problems(tmp_path, description(system("top", *map(level, range(10)))))
    assert any("more than 1000 components stand for systems" in each for each in found)


def test_entities_that_multiply_are_refused(tmp_path: Path) -> None:
    entities = '<!ENTITY e0 "xxxxxxxxxx">' + "".join(
        f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10)
    )
    content = description(system("&e9;", component("a")))
    (found,) = problems(tmp_path, f"<!DOCTYPE d [{entities}]>{content}")
    assert "is no XML: limit on input amplification factor" in found


def test_an_fmu_called_as_the_scenario_will_be_is_refused(tmp_path: Path) -> None:
    content = description(system("t", component("a", source="test.yaml")))
    (found,) = problems(tmp_path, content, {"test.yaml": PLANT})
    assert found.endswith("an FMU in it is called `test.yaml`")


def test_a_description_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adapters.ssp.package._LARGEST", 100)
    (found,) = problems(tmp_path, description(system("t", component("a"))))
    assert found.startswith("test.ssp/SystemStructure.ssd:1:1: has ")
    assert found.endswith(" bytes, more than 100")


@pytest.mark.parametrize(
    ("name", "base"),
    [
        ("m", {"m": "1"}),
        ("m/s", {"m": "1", "s": "-1"}),
        ("ms", {"s": "1", "factor": "0.001"}),
        ("degC", {"K": "1", "offset": "273.15"}),
    ],
)
def test_a_unit_is_written_with_what_it_needs(name: str, base: dict[str, str]) -> None:
    written = unit(parse_unit(name), name)
    (found,) = written.children
    assert (written.attributes, found.name, found.attributes) == (
        {"name": name},
        "ssc:BaseUnit",
        base,
    )
