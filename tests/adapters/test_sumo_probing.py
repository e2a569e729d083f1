"""SUMO opens a scene in a process of its own: its words come back, and nothing is written."""

import signal
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from adapters.sumo import probing
from adapters.sumo.checking import check_scene
from adapters.sumo.files import read_scene
from adapters.sumo.probing import Probe, probe
from tests.adapters.scene import NET, ROUTES, SHAPES, Folder, said

CAR = '<vehicle id="a" depart="0"><route edges="south_in north_out"/></vehicle>'


def contents(folder: Path) -> Mapping[Path, bytes]:
    """All files of a folder and below."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def opened(config: Path, timeout: float = 60.0) -> Probe:
    return probe(read_scene(config)[0], timeout=timeout)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals")
def test_a_crash_of_sumo_is_a_sentence_about_the_net(folder: Folder) -> None:
    folder.write(NET, "<net/>")
    found = opened(folder.config())
    number = signal.SIGSEGV.value
    assert said(found.problems) == [
        f"{NET}:1:1: SUMO crashed while loading {NET} (signal {number}, SIGSEGV)"
    ]


def test_what_sumo_says_keeps_the_place_that_it_names(folder: Folder) -> None:
    folder.write(NET, (folder.path / NET).read_text()[:5000])
    (problem,) = said(opened(folder.config()).problems)
    assert problem.startswith(f"{NET}:73:")
    assert problem.endswith("SUMO: unexpected end of input")


def test_what_sumo_says_of_an_id_is_placed_where_it_is_declared(folder: Folder) -> None:
    check = folder.routes(
        '<vehicle id="a" depart="0"/>',
        thorough=True,
    )
    assert said(check.problems) == [f"{ROUTES}:2:1: SUMO: Vehicle 'a' has no route."]


def test_a_vehicle_of_a_flow_is_placed_at_the_flow(folder: Folder) -> None:
    flow = '<flow id="f" begin="0" end="9" period="1" from="south_in" to="east_in"/>'
    check = folder.routes("", flow, thorough=True)
    assert said(check.problems) == [f"{ROUTES}:3:1: SUMO: Vehicle 'f.0' has no valid route."]
    assert f"{ROUTES}:3:1: SUMO: No route for vehicle 'f.0' found." in said(check.remarks)


def test_no_output_is_written_wherever_it_goes(folder: Folder, tmp_path: Path) -> None:
    away = tmp_path / "away.xml"
    folder.write(
        "inner.add.xml",
        f'<additional>\n<edgeData id="e" freq="1"\n  file = \'{away}\'/>'
        '<e1Detector id="d" lane="south_in_0" pos="5" freq="1" file="out/d.xml"/></additional>',
    )
    folder.write(SHAPES, '<additional>\n<include href="inner.add.xml"/>\n</additional>')
    folder.write(ROUTES, f"<routes>{CAR}</routes>")
    config = folder.config(
        routes=ROUTES,
        additional=SHAPES,
        more='<fcd-output value="fcd.xml"/><log value="out/log.txt"/>'
        f'<tripinfo-output value="{away}"/><remote-port value="8873"/>',
    )
    (folder.path / "out").mkdir()
    before = contents(folder.path)
    check = check_scene(config, thorough=True)
    assert check.problems == ()
    assert len(check.files.outputs) == 5
    assert contents(folder.path) == before
    (folder.path / "out").rmdir()  # as before the first run of a scene that is new here
    assert opened(config).problems == ()
    assert contents(folder.path) == before


def test_what_sumo_says_of_a_copy_names_the_original(folder: Folder) -> None:
    folder.write(
        SHAPES,
        '<additional>\n<edgeData id="e" file="e.xml"/>\n<busStop id="b" lane="south_in_0" '
        'startPos="900" endPos="990"/></additional>',
    )
    found = opened(folder.config(additional=SHAPES))
    assert found.problems
    assert all(str(folder.path) in p.where.file for p in found.problems)
    assert not any("nlosim-scene-" in str(p) for p in found.problems)


@pytest.mark.parametrize("encoding", ["utf-8", "iso-8859-1", "utf-16"])
def test_outputs_are_found_in_any_encoding(encoding: str, folder: Folder) -> None:
    text = (
        f'<?xml version="1.0" encoding="{encoding}"?>\r\n<additional>'
        '<edgeData id="Brücke" file="ü.xml"/><edgeData id="b" file="b.xml"/></additional>'
    )
    (folder.path / SHAPES).write_bytes(text.encode(encoding))
    before = set(folder.path.iterdir())
    config = folder.config(additional=SHAPES)
    found = opened(config)
    assert found.problems == ()
    assert set(folder.path.iterdir()) == before | {config}


def test_a_process_that_does_not_start_is_said(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(probing, "_MODULE", "adapters.sumo.nothing")
    (problem,) = said(opened(folder.config()).problems)
    assert problem.startswith("scene.sumocfg:1:1: SUMO could not be started: ")
    assert problem.endswith("No module named adapters.sumo.nothing")


def test_a_scene_that_takes_too_long_is_said(folder: Folder) -> None:
    found = opened(folder.config(), timeout=0.01)
    assert said(found.problems) == [
        "scene.sumocfg:1:1: SUMO was still loading scene.sumocfg after 0.01 s"
    ]
