"""What the configuration of a SUMO scene says, in every spelling that SUMO takes."""

import gzip
import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from adapters.sumo.checks.options import options, time
from adapters.sumo.files import FileKind, read_scene
from tests.adapters.scene import ASSETS, NET, Folder, said

TEMPLATE = """
import sys
from adapters.sumo.headless import import_libsumo
import_libsumo().start(["sumo", "--save-template", sys.argv[1], "--save-commented"])
"""
OPTION = re.compile(
    r'^ +<([\w.-]+)(?: value="[^"]*"(?: synonymes="([^"]*)")?(?: deprecated="[^"]*")?'
    r' type="([^"]+)")?/?>$',
    re.MULTILINE,
)


def test_the_table_of_options_is_that_of_the_installed_sumo(tmp_path: Path) -> None:
    template = tmp_path / "template.xml"
    subprocess.run([sys.executable, "-c", TEMPLATE, template], check=True, capture_output=True)
    lines = sorted(
        " ".join([kind or "SECTION", name, *synonyms.split()])
        for name, synonyms, kind in OPTION.findall(template.read_text())
    )
    table = Path(sys.modules[options.__module__].__file__ or "").with_name("options.txt")
    assert table.read_text().splitlines() == lines  # if SUMO is newer, write these lines there


@pytest.mark.parametrize(
    "config",
    [
        (
            '<configuration><input><net-file value="a.net.xml"/><route-files value="b.xml, c.xml"/>'
            '</input><time><begin value="57600"/></time></configuration>'
        ),
        (
            '<sumoConfiguration><n v="a.net.xml"/><r v="b.xml,c.xml"/><b v="16:00:00"/>'
            "</sumoConfiguration>"
        ),
        (
            "<configuration><input><net>a.net.xml</net><routes> b.xml,c.xml </routes></input>"
            '<a><b v="0:16:00:00"/></a></configuration>'
        ),
    ],
    ids=["names", "synonyms", "texts"],
)
def test_all_spellings_mean_the_same(config: str, tmp_path: Path) -> None:
    for name in ("a.net.xml", "b.xml", "c.xml"):
        (tmp_path / name).touch()
    (tmp_path / "scene.sumocfg").write_text(config)
    scene, problems = read_scene(tmp_path / "scene.sumocfg")
    assert not problems
    assert scene.net == tmp_path / "a.net.xml"
    assert scene.routes == (tmp_path / "b.xml", tmp_path / "c.xml")
    assert scene.begin == 57_600 * 10**9


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("57600", 57_600 * 10**9),
        ("0.1", 10**8),
        ("-1", -(10**9)),
        ("1:02:03:04.5", 93_784_500_000_000),
        ("1:30", None),
        ("noon", None),
        ("inf", None),
    ],
)
def test_times_are_seconds_or_clock_times(text: str, expected: int | None) -> None:
    assert time(text) == expected


def test_what_a_configuration_does_not_say_is_not_invented(folder: Folder) -> None:
    scene, _ = read_scene(folder.config())
    assert (scene.begin, scene.end, scene.step_length, scene.seed) == (None, None, None, None)
    more = '<time><step-length value="0.05"/><end value="-1"/></time><seed value="7"/>'
    scene, _ = read_scene(folder.config(more=more))
    assert (scene.step_length, scene.end, scene.seed) == (50_000_000, None, 7)
    scene, _ = read_scene(folder.config(more='<end value="3600"/>'))
    assert scene.end == 3600 * 10**9


def test_files_name_further_files_relative_to_themselves(folder: Folder) -> None:
    inner = folder.path / "inner"
    inner.mkdir()
    (inner / "more.add.xml").write_text(
        '<additional><rerouter id="r" edges="" file="closed.xml"/>'
        '<e1Detector id="d" lane="" pos="0" period="60" file="out/d.xml"/></additional>'
    )
    (inner / "closed.xml").write_text("<rerouter/>")
    folder.write("a.add.xml", '<additional>\n <include href="inner/more.add.xml"/>\n</additional>')
    output = '<output><fcd-output value="fcd.xml"/><log value="stdout"/></output>'
    scene, problems = read_scene(folder.config(additional="a.add.xml", more=output))
    assert not problems
    assert scene.additionals == (folder.path / "a.add.xml", inner / "more.add.xml")
    (data,) = (each for each in scene.inputs if each.kind is FileKind.DATA)
    assert data.path == inner / "closed.xml"
    assert {(each.path, each.named_by) for each in scene.outputs} == {
        (folder.path / "fcd.xml", "fcd-output"),
        (inner / "out" / "d.xml", "e1Detector file"),
    }
    (detector,) = (each for each in scene.outputs if each.named_by == "e1Detector file")
    assert (detector.where.file, detector.where.line) == (str(inner / "more.add.xml"), 1)
    assert set(scene.paths()) == {
        scene.config,
        folder.path / NET,
        folder.path / "a.add.xml",
        inner / "more.add.xml",
        inner / "closed.xml",
    }


def test_digests_are_those_of_the_stored_bytes(folder: Folder) -> None:
    with gzip.open(folder.path / "net.gz", "wb") as stream:
        stream.write((ASSETS / NET).read_bytes())
    outside = folder.path / "scene"
    outside.mkdir()
    config = shutil.move(folder.config(net="../net.gz"), outside)
    digests = read_scene(Path(config))[0].digests()
    assert set(digests) == {"scene.sumocfg", "../net.gz"}
    stored = (folder.path / "net.gz").read_bytes()
    assert digests["../net.gz"] == hashlib.sha256(stored).hexdigest()


def test_a_file_that_includes_itself_is_said_once(folder: Folder) -> None:
    folder.write("a.xml", '<additional><include href="b.xml"/></additional>')
    folder.write("b.xml", '<additional>\n<include href="a.xml"/>\n</additional>')
    _, problems = read_scene(folder.config(additional="a.xml"))
    path = folder.path / "a.xml"
    assert said(problems) == [f"b.xml:2:1: `include href`: {path} includes itself"]


def test_every_option_is_checked_at_its_place(folder: Folder) -> None:
    more = "\n".join(
        [
            '<step-lenght value="0.1"/>',
            '<seed value="many"/>',
            '<step-length value="x"/>',
            '<n value="again.net.xml"/>',
            "<log.processid/>",
            '<no-warnings value="maybe"/>',
            '<lateral-resolution value="wide"/>',
            '<weight-files value="${X}/w.xml"/>',
        ]
    )
    _, problems = read_scene(folder.config(net="no.net.xml", more=more))
    assert said(sorted(problems, key=lambda p: p.where)) == [
        f"scene.sumocfg:3:1: `net-file`: the file {folder.path / 'no.net.xml'} does not exist",
        "scene.sumocfg:5:1: SUMO has no option `step-lenght`; did you mean `step-length`?",
        "scene.sumocfg:6:1: `seed` is a whole number, got `many`",
        "scene.sumocfg:7:1: `step-length` is seconds, or `[days:]hours:minutes:seconds`, got `x`",
        "scene.sumocfg:8:1: `n` is set in line 3 already",
        'scene.sumocfg:9:1: `log.processid` has no value; write `<log.processid value="..."/>`',
        "scene.sumocfg:10:1: `no-warnings` is `true` or `false`, got `maybe`",
        "scene.sumocfg:11:1: `lateral-resolution` is a number, got `wide`",
        (
            "scene.sumocfg:12:1: `weight-files`: w.xml depends on an environment variable; "
            "write the path"
        ),
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<net/>", "1:1: not a SUMO configuration: it begins with `<net>` instead of"),
        ("", "1:1: not XML: no element found; the file is empty or has been cut off"),
        ("<configuration>\n <input>", "2:9: not XML: no element found; the file is empty"),
        ("<configuration/>", "1:1: the configuration names no net; add"),
        ('<!DOCTYPE c [<!ENTITY a "b">]><configuration/>', "1:13: a document type"),
        (
            '<?xml version="1.0" encoding="none"?><a/>',
            "1:1: cannot be decoded (unknown encoding: none)",
        ),
    ],
)
def test_what_is_no_configuration_is_said(text: str, expected: str, folder: Folder) -> None:
    _, problems = read_scene(folder.write("scene.sumocfg", text))
    assert len(problems) == 1
    assert said(problems)[0].startswith(f"scene.sumocfg:{expected}")


def test_a_configuration_that_does_not_exist_is_said(folder: Folder) -> None:
    _, problems = read_scene(folder.path / "no.sumocfg")
    assert said(problems) == ["no.sumocfg:1:1: cannot be read: No such file or directory"]
