"""`nlosim export --mcap`: what the reader of MCAP files finds is what was recorded."""

import json
import math
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import POINT
from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from studies.exports.geo import read_location
from studies.exports.show import clouds
from studies.exports.triangles import prism, triangulated
from tests.recordings import output, record
from tests.studies.exports.crowd import NET, UTM

pytest.importorskip("foxglove")
reading = pytest.importorskip("mcap.reader")
decoding = pytest.importorskip("mcap_protobuf.decoder")

Found = Mapping[str, list[tuple[int, Any]]]


def messages(path: Path) -> Found:
    """Times [ns] and messages by topic; those of JSON as they are."""
    found = defaultdict(list)
    with path.open("rb") as file:
        reader = reading.make_reader(file, decoder_factories=[decoding.DecoderFactory()])
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                content = json.loads(message.data)
            else:
                content = decoding.DecoderFactory().decoder_for("protobuf", schema)(message.data)
            found[channel.topic].append((message.log_time, content))
    return found


@pytest.fixture(scope="module")
def exported(street: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mcap") / "street.mcap"
    assert main(["export", str(street), "--mcap", "--out", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def found(exported: Path) -> Found:
    return messages(exported)


def test_every_road_user_is_a_box_where_it_was(found: Found, street: Path) -> None:
    recording = Recording(street)
    ids, places, sizes, headings = (
        recording[f"road.vehicle.{name}"] for name in ("id", "position", "size", "heading")
    )
    assert [time for time, _ in found["/scene"]] == ids.times.tolist()
    for k, (_, update) in enumerate(found["/scene"]):
        assert [entity.id for entity in update.entities] == [str(n) for n in np.asarray(ids[k])]
        for entity, place, size, heading in zip(
            update.entities,
            np.asarray(places[k]),
            np.asarray(sizes[k]),
            np.asarray(headings[k]),
            strict=True,
        ):
            (cube,) = entity.cubes
            at, turn = cube.pose.position, cube.pose.orientation
            assert (at.x, at.y) == (place[0], place[1])
            assert at.z == size[2] / 2
            assert (cube.size.x, cube.size.y, cube.size.z) == tuple(size)
            yaw = 2 * math.atan2(turn.z, turn.w)
            assert math.cos(yaw - heading) == pytest.approx(1.0, abs=1e-12)
            assert entity.frame_id == "world"


def test_who_leaves_is_deleted_once(found: Found) -> None:
    """The person is last seen at 1 s."""
    deleted = [
        (time, [each.id for each in update.deletions])
        for time, update in found["/scene"]
        if update.deletions
    ]
    assert len(deleted) == 1
    time, (number,) = deleted[0]
    before = [u for t, u in found["/scene"] if t == time - 100_000_000]
    named = {e.id: {p.key: p.value for p in e.metadata} for e in before[0].entities}
    assert named[number]["name"] == "walker"
    assert named[number]["type"] == "pedestrian"
    assert time == 1_100_000_000


def test_frames_are_those_of_road_users(found: Found, street: Path) -> None:
    _, transforms = found["/tf"][5]
    first = transforms.transforms[0]
    assert first.parent_frame_id == "world"
    assert first.child_frame_id == "red car"
    place = np.asarray(Recording(street)["road.vehicle.position"][5])[0]
    assert (first.translation.x, first.translation.y, first.translation.z) == tuple(place)


def test_points_are_those_of_the_lidar(found: Found, street: Path) -> None:
    series = Recording(street)["scanner.points"]
    topics = [topic for topic in found if topic.startswith("/points/scanner.points/")]
    assert len(topics) == 3
    count = 0
    for k, data in enumerate(series):
        for sensor, points in clouds(bytes(data)):
            sent = dict(found[f"/points/scanner.points/{sensor['vehicle']}"])
            cloud = sent[int(series.times[k])]
            assert cloud.data == points.tobytes()
            assert cloud.point_stride == POINT.itemsize == 20
            names = [(field.name, field.offset) for field in cloud.fields]
            assert names[:3] == [("x", 0), ("y", 4), ("z", 8)]
            assert (cloud.pose.position.x, cloud.pose.position.y) == tuple(sensor["position"][:2])
            count += len(points)
    assert count > 1000


def test_buildings_stand_where_they_are(found: Found) -> None:
    ((_, update),) = found["/surroundings"]
    (entity,) = update.entities
    (house,) = entity.triangles
    corners = {(point.x, point.y, point.z) for point in house.points}
    ground = {(-10.0, 8.0), (30.0, 8.0), (30.0, 20.0), (-10.0, 20.0)}
    assert corners == {(x, y, z) for x, y in ground for z in (0.0, 12.0)}
    assert len(house.indices) == 3 * (4 * 2 + 2)


def test_numbers_and_the_log_are_there(found: Found, street: Path) -> None:
    counts = Recording(street)["messages.received.sensor_data.count"]
    told = found["/signals/messages"]
    assert [time for time, _ in told] == counts.times.tolist()
    assert told[0][1] == {"received": {"sensor_data": {"count": 0}}}
    texts = [message.message for _, message in found["/log"]]
    assert any(text.startswith("done; fingerprint") for text in texts)
    assert len(texts) == len((street / "log.txt").read_text().splitlines())


def test_numbers_are_groups_of_groups_with_a_schema_and_units(tmp_path: Path) -> None:
    """Viewers take a dot in a path for a step inwards."""
    connectors = {
        "gap": output(unit="m"),
        "gap.least": output(unit="m"),
        "place": output(2, unit="m"),
        "is_there": output(dtype=np.bool_),
    }
    samples = [
        {
            "gap": np.array(value),
            "gap.least": np.array(-value),
            "place": np.array([1.0, value]),
            "is_there": np.array(True),
        }
        for value in (2.0, 3.0)
    ]
    record(tmp_path / "run", connectors, samples, component="car")
    path = tmp_path / "run.mcap"
    assert main(["export", str(tmp_path / "run"), "--mcap", "--out", str(path)]) == 0
    told = [content for _, content in messages(path)["/signals/car"]]
    first = {"gap": {"value": 2.0, "least": -2.0}, "place": [1.0, 2.0], "is_there": True}
    assert told[0] == first
    assert [each["place"] for each in told] == [[1.0, 2.0], [1.0, 3.0]]
    with path.open("rb") as file:
        schemas = reading.make_reader(file).get_summary().schemas.values()
    (schema,) = [json.loads(each.data) for each in schemas if each.name == "car"]
    length = {"type": "number", "description": "m"}
    assert schema == {
        "title": "car",
        "type": "object",
        "properties": {
            "gap": {"type": "object", "properties": {"value": length, "least": length}},
            "place": {"type": "array", "items": length},
            "is_there": {"type": "boolean", "description": "1"},
        },
    }


def test_messages_are_in_the_order_of_time(exported: Path) -> None:
    with exported.open("rb") as file:
        times = [
            m.log_time for _, _, m in reading.make_reader(file).iter_messages(log_time_order=False)
        ]
    assert times == sorted(times)


def test_the_file_says_what_was_run(exported: Path, street: Path) -> None:
    with exported.open("rb") as file:
        (about,) = reading.make_reader(file).iter_metadata()
    assert about.name == "nlosim"
    assert about.metadata["title"] == "A street from a file"
    assert about.metadata["fingerprint"] == Recording(street).manifest["fingerprint"]


def test_without_the_sdk_it_is_said_what_to_install(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["export", str(run), "--mcap"]) == 2
    assert "--mcap needs `foxglove`" in (said := capsys.readouterr().err)
    assert "pip install 'nlosim[mcap]'" in said
    assert not (run / "export").exists()


@pytest.mark.parametrize(
    ("ring", "count"),
    [
        ([(0, 0), (4, 0), (4, 3), (0, 3)], 2),
        ([(0, 0), (0, 3), (4, 3), (4, 0)], 2),  # clockwise
        ([(0, 0), (6, 0), (6, 6), (3, 1), (0, 6)], 3),  # not convex
        ([(0, 0), (2, 0), (4, 0), (4, 3), (0, 3)], 2),  # three on a line
        ([(0, 0), (9, 0), (9, 9), (0, 9), (0, 6), (6, 6), (6, 3), (0, 3)], 6),
    ],
)
def test_triangles_cover_the_polygon_once(ring: list[tuple[float, float]], count: int) -> None:
    points = np.array(ring, float)
    x, y = points.T
    area = abs(0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))
    triangles = triangulated(points)
    assert len(triangles) == count
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(area)


def test_walls_of_a_prism_have_its_perimeter() -> None:
    vertices, triangles = prism(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]), 5.0)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    assert areas.sum() == pytest.approx(14 * 5 + 12)


def test_of_what_cannot_be_read_the_rest_is_shown(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hurt = run / "signals" / "scanner" / "points.zst"
    data = bytearray(hurt.read_bytes())
    data[len(data) // 2] ^= 255
    hurt.write_bytes(data)
    assert main(["export", str(run), "--mcap", "--json"]) == 0
    (said,) = json.loads(capsys.readouterr().out)["left_out"]
    assert said.startswith("`scanner.points` is left out from 0 s on: ")
    assert f"`{hurt}` is damaged" in said
    found = messages(run / "export" / "run.mcap")
    assert len(found["/scene"]) == 21
    assert not [topic for topic in found if topic.startswith("/points")]


def test_driven_entities_have_their_names_and_places_on_the_earth(busy: Path) -> None:
    net = busy / "map.net.xml"
    net.write_text(NET.format(projection=UTM.format(zone=32), offset="-456000.00,-5427000.00"))
    manifest = json.loads((busy / "manifest.json").read_text())
    (busy / "manifest.json").write_text(
        json.dumps({**manifest, "files": {"streets": {str(net): ""}}})
    )
    assert main(["export", str(busy), "--mcap"]) == 0
    found = messages(busy / "export" / "busy.mcap")
    projection = read_location(net, None, is_moved=False)
    assert projection is not None
    fixes = found["/location/ego"]
    assert [time for time, _ in fixes] == [100_000_000 * k for k in range(1, 5)]
    for k, (_, fix) in enumerate(fixes, start=1):
        expected = projection.degrees(np.array([[3.0 * k, 1.5]]))[0]
        assert (fix.longitude, fix.latitude) == pytest.approx(tuple(expected), abs=1e-12)
    labels = [[e.texts[0].text for e in u.entities if e.texts] for _, u in found["/scene"]]
    assert labels == [[], *[['tall "one"']] * 4]
    ((_, plan),) = found["/map"]
    assert json.loads(plan.geojson) == {"type": "FeatureCollection", "features": []}


def test_lights_show_their_states(busy: Path) -> None:
    assert main(["export", str(busy), "--mcap"]) == 0
    told = messages(busy / "export" / "busy.mcap")["/lights"]
    assert len(told) == 5
    red, green = told[0][1].entities[0].spheres
    assert (red.pose.position.x, red.pose.position.y) == (20.0, 5.0)
    assert red.color.r > 2 * red.color.g
    assert green.color.g > 2 * green.color.r
    assert told[4][1].entities[0].spheres[0].color == told[4][1].entities[0].spheres[1].color


def test_who_has_no_body_is_no_box(busy: Path) -> None:
    assert main(["export", str(busy), "--mcap"]) == 0
    found = messages(busy / "export" / "busy.mcap")
    assert [len(update.entities) for _, update in found["/scene"]] == [3] * 5
    assert [len(update.transforms) for _, update in found["/tf"]] == [4] * 5
