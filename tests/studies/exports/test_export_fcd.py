"""`nlosim export --fcd`: SUMO's schema holds, and our own replay drives where the run did."""

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from adapters.traffic.bodies import Body
from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from studies.exports.geo import read_location
from tests.recordings import record
from tests.studies.exports.crowd import CROWD, NET, UTM, crowd


def elements(directory: Path) -> list[etree._Element]:
    return list(etree.parse(str(directory / "export/fcd/traffic.fcd.xml")).getroot())


def test_angles_fronts_and_speeds_are_those_of_sumo(busy: Path) -> None:
    assert main(["export", str(busy), "--fcd"]) == 0
    steps = elements(busy)
    assert [step.get("time") for step in steps] == ["0.00", "0.10", "0.20", "0.30", "0.40"]
    truck, car, walker = steps[2]
    assert (truck.tag, car.tag, walker.tag) == ("vehicle", "vehicle", "person")
    assert truck.get("id") == 'tall "one"'
    assert float(truck.get("angle", "")) == pytest.approx(90.0 - np.degrees(0.6), abs=1e-6)
    assert float(truck.get("x", "")) == pytest.approx(6.0 + 4.0 * np.cos(0.6), abs=1e-6)
    assert float(truck.get("y", "")) == pytest.approx(1.5 + 4.0 * np.sin(0.6), abs=1e-6)
    assert float(truck.get("speed", "")) == 5.0
    assert (car.get("angle"), car.get("x"), car.get("y")) == ("270.000000", "6.000000", "-2.000000")
    assert walker.get("angle") == "180.000000"
    assert truck.get("z") is None


def test_types_that_differ_in_size_are_two(busy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(busy), "--fcd", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["left_out"] == ["1 roadside unit is left out: FCD has no element for it"]
    types = etree.parse(str(busy / "export/fcd/types.add.xml")).getroot()
    found = {kind.get("id"): (kind.get("vClass"), float(kind.get("length"))) for kind in types}
    assert found == {
        "lorry": ("truck", 8.0),
        "lorry@b": ("truck", 6.0),
        "person": ("pedestrian", 0.3),
    }
    assert elements(busy)[0][1].get("type") == "lorry@b"


@pytest.mark.skipif(find_spec("sumo_data") is None, reason="SUMO's schemas are not installed")
def test_the_schemas_of_sumo_hold(busy: Path) -> None:
    assert main(["export", str(busy), "--fcd"]) == 0
    spec = find_spec("sumo_data")
    assert spec is not None
    (folder, *_) = spec.submodule_search_locations or [""]
    schemas = Path(folder) / "data" / "xsd"
    for file, schema in (
        ("traffic.fcd.xml", "fcd_file.xsd"),
        ("types.add.xml", "additional_file.xsd"),
    ):
        tree = etree.parse(str(busy / "export/fcd" / file))
        etree.XMLSchema(etree.parse(str(schemas / schema))).assertValid(tree)


REPLAY = """\
schema: 1
title: Again
time: {{start: 0 s, stop: {stop} s}}
components:
  again:
    type: fcd-replay
    step: 100 ms
    parameters: {{file: {folder}/traffic.fcd.xml, types_file: {folder}/types.add.xml}}
connections: []
"""


@pytest.mark.parametrize("name", ["run", "busy"])
def test_our_replay_drives_where_the_run_did(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    directory: Path = request.getfixturevalue(name)
    assert main(["export", str(directory), "--fcd"]) == 0
    folder = directory / "export" / "fcd"
    stop = elements(directory)[-1].get("time")
    (tmp_path / "again.yaml").write_text(REPLAY.format(folder=folder, stop=stop))
    out = tmp_path / "again"
    assert (
        main(["run", str(tmp_path / "again.yaml"), "--no-figure", "--out", str(out), "--quiet"])
        == 0
    )
    before, after = Recording(directory), Recording(out)
    prefix = "road.vehicle" if name == "run" else "streets.who"
    assert len(after["again.vehicle.id"]) == len(before[f"{prefix}.id"])
    for signal, tolerance in (("position", 2e-6), ("heading", 2e-8), ("size", 1e-6)):
        for k, (old, new) in enumerate(
            zip(before[f"{prefix}.{signal}"], after[f"again.vehicle.{signal}"], strict=True)
        ):
            is_body = np.asarray(before[f"{prefix}.size"][k])[:, 0] > 0.01
            expected = np.asarray(old)[is_body]
            if signal == "heading":
                gap = (np.asarray(new) - expected + np.pi) % (2 * np.pi) - np.pi
                assert np.abs(gap).max(initial=0.0) < tolerance
            else:
                assert np.abs(np.asarray(new) - expected).max(initial=0.0) < tolerance
    kinds = [np.asarray(each).tolist() for each in after["again.vehicle.body"]]
    assert kinds[0][-1] == Body.PEDESTRIAN


def test_who_has_no_body_is_left_out_of_the_replay(busy: Path) -> None:
    assert main(["export", str(busy), "--fcd"]) == 0
    assert [len(step) for step in elements(busy)] == [3] * 5


def test_without_road_users_it_is_said_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lacking = {name: each for name, each in CROWD.items() if name != "who.size"}
    samples = [{name: each for name, each in crowd(0).items() if name != "who.size"}]
    record(tmp_path / "run", lacking, samples, component="streets")
    assert main(["export", str(tmp_path / "run"), "--fcd"]) == 2
    assert (
        "no road users are recorded: `id`, `position`, `heading`, `velocity`, `size` along one "
        "axis of one component; of `streets.who` not all of these are"
    ) in capsys.readouterr().err
    assert not (tmp_path / "run" / "export" / "fcd").exists()


@pytest.mark.parametrize(
    ("projection", "offset"),
    [
        (UTM.format(zone=32), "-456000.00,-5427000.00"),
        (UTM.format(zone=33), "-200000.00,-7800000.00"),
        (UTM.format(zone=10) + " +south", "-800000.00,-5000000.00"),
        ("+proj=tmerc +lat_0=0 +lon_0=9 +k=1 +x_0=3500000 +y_0=0 +ellps=GRS80", "-3.5e6,-5.5e6"),
    ],
)
def test_degrees_are_those_of_sumo(projection: str, offset: str, tmp_path: Path) -> None:
    """SUMO asks PROJ; a nanodegree is a tenth of a millimetre, and this is a fiftieth of it."""
    libsumo = pytest.importorskip("libsumo")
    net = tmp_path / "map.net.xml"
    net.write_text(NET.format(projection=projection, offset=offset))
    points = np.array([[0.0, 0.0], [900.0, 0.0], [12.5, 690.25], [50_000.0, 30_000.0]])
    found = read_location(net, None, is_moved=True)
    assert found is not None
    libsumo.start(["sumo", "-n", str(net), "--no-step-log", "--no-warnings"])
    try:
        expected = [libsumo.simulation.convertGeo(*point) for point in points.tolist()]
    finally:
        libsumo.close()
    assert np.abs(found.degrees(points) - np.array(expected)).max() < 2e-11


@pytest.mark.parametrize(
    ("origin", "parameters", "expected"),
    [
        (None, "of SUMO", (455_000.0, 5_427_000.0)),
        (None, "of a replay", (0.0, 0.0)),
        ({"x": "455500.0 m", "y": "10.0 m"}, "of SUMO", (455_500.0, 10.0)),
    ],
)
def test_a_net_that_is_far_away_counts_from_its_corner(
    origin: dict[str, str] | None, parameters: str, expected: tuple[float, float], tmp_path: Path
) -> None:
    net = tmp_path / "far.net.xml"
    text = NET.format(projection=UTM.format(zone=32), offset="0.00,0.00")
    net.write_text(text.replace("0.00,0.00,900.00,700.00", "455100.5,5427900.0,456000.0,5428600.0"))
    found = read_location(net, origin, is_moved=parameters == "of SUMO")
    assert found is not None
    assert found.offset == expected


@pytest.mark.parametrize(
    "projection", ["!", "+proj=lcc +lat_1=30 +lat_2=60", "+proj=tmerc +lat_0=49"]
)
def test_other_projections_are_not_known(projection: str, tmp_path: Path) -> None:
    net = tmp_path / "map.net.xml"
    net.write_text(NET.format(projection=projection, offset="0,0"))
    assert read_location(net, None, is_moved=True) is None
    net.write_text("<net/>")
    assert read_location(net, None, is_moved=True) is None
    assert read_location(tmp_path / "none.net.xml", None, is_moved=True) is None


def test_geo_without_a_projection_is_refused(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(run), "--fcd", "--geo"]) == 2
    assert "--geo: no net of this run has a projection" in capsys.readouterr().err


def test_geo_writes_degrees(run: Path) -> None:
    """As SUMO's --fcd-output.geo: x is the longitude."""
    net = run / "map.net.xml"
    net.write_text(NET.format(projection=UTM.format(zone=32), offset="-456000.00,-5427000.00"))
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["files"]["road"][str(net)] = "0" * 64
    (run / "manifest.json").write_text(json.dumps(manifest))
    assert main(["export", str(run), "--fcd", "--geo"]) == 0
    first = elements(run)[0][0]
    projection = read_location(net, None, is_moved=False)
    assert projection is not None
    length = float(np.asarray(Recording(run)["road.vehicle.size"][0])[0, 0])
    expected = projection.degrees(np.array([[-60.0 + length / 2, -2.0]]))[0]
    assert float(first.get("x", "")) == pytest.approx(expected[0], abs=1e-9)
    assert float(first.get("y", "")) == pytest.approx(expected[1], abs=1e-9)
    assert 8 < expected[0] < 9
    assert 48 < expected[1] < 50
