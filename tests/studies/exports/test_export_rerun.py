"""`nlosim export --rerun`: what Rerun's own reader finds is what was recorded."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import NO_VEHICLE, PACKET, RECEPTION, unframe
from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from studies.exports.geo import read_location
from studies.exports.show import clouds
from tests.studies.exports.crowd import NET, UTM

pytest.importorskip("rerun")
reading = pytest.importorskip("rerun.chunk")

SAMPLE = 100_000_000
Columns = Mapping[str, list[Any]]
Found = Mapping[str, Sequence[Columns]]


def read(path: Path) -> Found:
    """The chunks of each entity, as columns by name; times [ns] as numbers."""
    found: dict[str, list[Columns]] = {}
    for chunk in reading.RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        columns = {}
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            is_time = str(column.type).startswith(("duration", "timestamp"))
            columns[name] = (column.cast("int64") if is_time else column).to_pylist()
        found.setdefault(chunk.entity_path, []).append(columns)
    return found


def of(found: Found, entity: str, column: str) -> tuple[list[int], list[Any]]:
    """Times [ns] and values of a column; no times if it never changes."""
    (columns,) = [each for each in found[entity] if column in each]
    return columns.get("time", []), columns[column]


def at(times: list[int], values: list[Any], time: int) -> Any:
    """What a viewer shows at a time [ns]: the newest until then."""
    return values[int(np.searchsorted(times, time, side="right")) - 1]


@pytest.fixture(scope="module")
def exported(street: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rerun") / "street.rrd"
    assert main(["export", str(street), "--rerun", "--out", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def found(exported: Path) -> Found:
    return read(exported)


def command(*words: str | Path, home: Path) -> subprocess.CompletedProcess[str]:
    """The command line of Rerun, which keeps what it keeps in `home`."""
    return subprocess.run(
        [sys.executable, "-m", "rerun", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "HOME": str(home)},
    )


def test_every_road_user_is_where_it_was_at_every_sample(found: Found, street: Path) -> None:
    recording = Recording(street)
    ids, places, headings = (
        recording[f"road.vehicle.{name}"] for name in ("id", "position", "heading")
    )
    times, translations = of(found, "/world/users/red\\ car", "Transform3D:translation")
    _, turns = of(found, "/world/users/red\\ car", "Transform3D:quaternion")
    assert times == ids.times.tolist()
    assert len(times) == 21
    for time in (0, 7 * SAMPLE, 20 * SAMPLE):
        k = time // SAMPLE
        (row,) = np.flatnonzero(np.asarray(ids[k]) == 0)
        expected = np.asarray(places[k])[row].astype(np.float32).tolist()
        assert at(times, translations, time) == [expected]
        ((x, y, z, w),) = at(times, turns, time)
        assert (x, y) == (0.0, 0.0)
        heading = float(np.asarray(headings[k])[row])
        assert np.cos(2 * np.arctan2(z, w) - heading) == pytest.approx(1.0, abs=1e-6)
    moved = [each[0][0] for each in translations]
    assert moved[-1] - moved[0] == pytest.approx(30.0)


def test_there_are_as_many_rows_as_samples_of_all(found: Found, street: Path) -> None:
    rows = sum(
        len(each["Transform3D:translation"])
        for entity, chunks in found.items()
        if entity.startswith("/world/users/")
        for each in chunks
        if "Transform3D:translation" in each
    )
    assert rows == int(Recording(street)["road.vehicle.id"].lengths.sum())


def test_boxes_have_their_size_class_and_colour(found: Found, street: Path) -> None:
    recording = Recording(street)
    sizes = np.asarray(recording["road.vehicle.size"][0])
    bodies = np.asarray(recording["road.vehicle.body"][0]).tolist()
    names = ["red\\ car", "white\\ van", "bus", "walker"]
    colours = set()
    for name, size, body in zip(names, sizes, bodies, strict=True):
        times, half = of(found, f"/world/users/{name}", "Boxes3D:half_sizes")
        assert times == [0]
        assert half == [[(size.astype(np.float32) / 2).tolist()]]
        assert of(found, f"/world/users/{name}", "Boxes3D:centers")[1][0][0][2] == half[0][0][2]
        assert of(found, f"/world/users/{name}", "Boxes3D:class_ids")[1] == [[body]]
        colours.add(of(found, f"/world/users/{name}", "Boxes3D:colors")[1][0][0])
    assert len(colours) == 4
    _, ((classes,),) = of(found, "/world/users", "AnnotationContext:context")
    labels = {each["class_id"]: each["class_description"]["info"]["label"] for each in classes}
    assert [labels[body] for body in bodies] == ["car", "van", "bus", "pedestrian"]
    assert of(found, "/world/users/walker", "type")[1] == [["pedestrian"]]


def test_who_leaves_is_cleared_once(found: Found) -> None:
    """The person is last seen at 1 s."""
    times, values = of(found, "/world/users/walker", "Clear:is_recursive")
    assert (times, values) == ([11 * SAMPLE], [[False]])
    assert of(found, "/world/users/walker", "Transform3D:translation")[0][-1] == 10 * SAMPLE
    assert not any("Clear:is_recursive" in each for each in found["/world/users/bus"])


def test_points_are_those_of_the_lidar(found: Found, street: Path) -> None:
    series = Recording(street)["scanner.points"]
    count = 0
    for k, data in enumerate(series):
        for sensor, points in clouds(bytes(data)):
            entity = f"/world/points/scanner.points/{sensor['vehicle']}"
            time = int(series.times[k])
            sent = {
                name: at(*of(found, entity, name), time)
                for name in ("Points3D:positions", "instance", "Transform3D:translation")
            }
            assert sent["Points3D:positions"] == points["position"].tolist()
            assert sent["instance"] == points["instance"].tolist()
            assert sent["Transform3D:translation"] == [sensor["position"].astype("f4").tolist()]
            count += len(points)
    assert count > 1000


def test_buildings_stand_where_they_are(found: Found) -> None:
    _, (vertices,) = of(found, "/world/buildings", "Mesh3D:vertex_positions")
    _, (triangles,) = of(found, "/world/buildings", "Mesh3D:triangle_indices")
    ground = {(-10.0, 8.0), (30.0, 8.0), (30.0, 20.0), (-10.0, 20.0)}
    assert {tuple(each) for each in vertices} == {(*c, z) for c in ground for z in (0.0, 12.0)}
    assert len(triangles) == 4 * 2 + 2


def test_numbers_have_their_names_and_units(busy: Path, found: Found, street: Path) -> None:
    counts = Recording(street)["messages.received.sensor_data.count"]
    entity = "/signals/messages/received.sensor_data.count"
    times, values = of(found, entity, "Scalars:scalars")
    assert times == counts.times.tolist()
    assert values == [[float(each)] for each in np.asarray(counts.values)]
    assert of(found, entity, "SeriesLines:names")[1] == [["received.sensor_data.count"]]
    assert main(["export", str(busy), "--rerun"]) == 0
    other = read(busy / "export" / "busy.rrd")
    entity = "/signals/streets/ego.position\\[0\\]"
    assert of(other, entity, "Scalars:scalars")[1] == [[0.0], [3.0], [6.0], [9.0], [12.0]]
    assert of(other, entity, "SeriesLines:names")[1] == [["ego.position[0] [m]"]]
    assert of(other, entity, "unit")[1] == [["m"]]


def test_the_log_is_there_with_the_time_of_the_clock(found: Found, street: Path) -> None:
    (log,) = found["/log"]
    assert len(log["TextLog:text"]) == len((street / "log.txt").read_text().splitlines())
    assert any("done; fingerprint" in text for (text,) in log["TextLog:text"])
    assert set(log["time"]) == {0}
    created = np.datetime64(Recording(street).manifest["created"].partition("+")[0]).astype("M8[s]")
    assert abs(log["clock"][0] // 10**9 - int(created.astype("int64"))) < 60


def test_the_file_says_what_was_run(exported: Path, found: Found, street: Path) -> None:
    (store,) = reading.RrdReader(str(exported)).recordings()
    fingerprint = Recording(street).manifest["fingerprint"]
    assert (store.application_id, store.recording_id) == ("nlosim", fingerprint)
    (said,) = found["/__properties/nlosim"]
    assert said["title"] == [["A street from a file"]]
    assert said["fingerprint"] == [[fingerprint]]
    assert of(found, "/__properties", "RecordingInfo:name")[1] == [["run"]]


def test_rerun_itself_verifies_it_and_finds_no_difference_to_a_second_export(
    exported: Path, street: Path, busy: Path, tmp_path: Path
) -> None:
    """The SDK numbers chunks and rows by the clock, so bytes differ."""
    assert command("rrd", "verify", exported, home=tmp_path).returncode == 0
    again = tmp_path / "again.rrd"
    assert main(["export", str(street), "--rerun", "--out", str(again)]) == 0
    assert command("rrd", "compare", exported, again, home=tmp_path).returncode == 0
    assert main(["export", str(busy), "--rerun"]) == 0
    other = busy / "export" / "busy.rrd"
    assert command("rrd", "compare", exported, other, home=tmp_path).returncode != 0


@pytest.fixture(scope="module")
def encounter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The red light until sensor data come by relays."""
    out = tmp_path_factory.mktemp("encounter") / "run"
    sets = ["--set", "time.stop=8 s", "--set", "measures={}", "--set", "report=null"]
    words = ["run", "red_light", *sets, "--quiet", "--no-figure", "--out", str(out)]
    assert main(words) == 0
    return out


def test_links_are_the_frames_that_the_ego_noticed(encounter: Path) -> None:
    assert main(["export", str(encounter), "--rerun"]) == 0
    found = read(encounter / "export" / "run.rrd")
    recording = Recording(encounter)
    receptions = recording["channel.receptions"]
    records = np.concatenate([unframe("RCPT", bytes(each), RECEPTION) for each in receptions])
    packets = np.concatenate(
        [unframe("PKTS", bytes(each), PACKET) for each in recording["facilities.packets"]]
    )
    ego = int(np.asarray(recording["traffic.ego.id"][0]))
    noticed = records[(records["receiver"] == ego) & (records["outcome"] < 5)]
    for code, link in enumerate(("LOS", "NLOSv", "NLOSb")):
        expected = int(((noticed["link"] == code) & (noticed["outcome"] == 0)).sum())
        assert expected > 0
        _, strips = of(found, f"/world/links/{link}", "LineStrips3D:strips")
        assert sum(map(len, strips)) == expected
    _, lost = of(found, "/world/links/lost", "LineStrips3D:strips")
    assert sum(map(len, lost)) == int((noticed["outcome"] > 0).sum())
    times, strips = of(found, "/world/links/LOS", "LineStrips3D:strips")
    places = recording["traffic.ego.position"]
    for time, lines in zip(times, strips, strict=True):
        within = (places.times > time - 2 * SAMPLE) & (places.times <= time)
        there = {np.float32(places[k][1]) for k in np.flatnonzero(within).tolist()}
        assert {np.float32(line[1][1]) for line in lines} <= there
    to_one = packets["id"][packets["destination"] != NO_VEHICLE]
    came = records[
        np.isin(records["packet"], to_one) & (records["addressed"] == 1) & (records["outcome"] == 0)
    ]
    sent = sum(
        len(lines)
        for entity in found
        if entity.startswith("/world/messages/") and not entity.endswith("/lost")
        for lines in of(found, entity, "LineStrips3D:strips")[1]
    )
    assert sent == len(came) > 0


def test_driven_entities_have_their_names_and_places_on_the_earth(busy: Path) -> None:
    net = busy / "map.net.xml"
    net.write_text(NET.format(projection=UTM.format(zone=32), offset="-456000.00,-5427000.00"))
    manifest = json.loads((busy / "manifest.json").read_text())
    files = {"streets": {str(net): ""}}
    (busy / "manifest.json").write_text(json.dumps({**manifest, "files": files}))
    assert main(["export", str(busy), "--rerun"]) == 0
    found = read(busy / "export" / "busy.rrd")
    projection = read_location(net, None, is_moved=False)
    assert projection is not None
    entity = '/world/users/tall\\ \\"one\\"'
    times, shown = of(found, entity, "Boxes3D:show_labels")
    assert (times, shown) == ([0, SAMPLE], [[False], [True]])
    times, places = of(found, entity.replace("world/users", "location"), "GeoPoints:positions")
    assert times == [SAMPLE * k for k in range(1, 5)]
    for k, ((latitude, longitude),) in enumerate(places, start=1):
        expected = projection.degrees(np.array([[3.0 * k, 1.5]]))[0]
        assert (longitude, latitude) == pytest.approx(tuple(expected), abs=1e-12)
    _, states = of(found, "/world/lights", "Points3D:class_ids")
    assert states == [[1, 5 - k] for k in range(5)]


def test_who_has_no_body_is_no_box(busy: Path) -> None:
    assert main(["export", str(busy), "--rerun"]) == 0
    found = read(busy / "export" / "busy.rrd")
    unit = found["/world/users/1000000"]
    assert any("Transform3D:translation" in each for each in unit)
    assert not any("Boxes3D:half_sizes" in each for each in unit)


def test_of_what_cannot_be_read_the_rest_is_there(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hurt = run / "signals" / "scanner" / "points.zst"
    data = bytearray(hurt.read_bytes())
    data[len(data) // 2] ^= 255
    hurt.write_bytes(data)
    assert main(["export", str(run), "--rerun", "--json"]) == 0
    (said,) = [
        each
        for each in json.loads(capsys.readouterr().out)["left_out"]
        if "no links are drawn" not in each
    ]
    assert said.startswith("`scanner.points` is left out from 0 s on: ")
    found = read(run / "export" / "run.rrd")
    assert len(of(found, "/world/users/bus", "Transform3D:translation")[0]) == 21
    assert not [entity for entity in found if entity.startswith("/world/points/")]


def test_without_the_sdk_it_is_said_what_to_install(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["export", str(run), "--rerun"]) == 2
    assert "--rerun needs `rerun`" in (said := capsys.readouterr().err)
    assert "pip install 'nlosim[rerun]'" in said
    assert not (run / "export").exists()
