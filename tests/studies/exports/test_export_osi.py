"""`nlosim export --osi`: what OSI's own reader finds is what was recorded."""

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import GROUND, POINT, SENSOR
from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.exports.geo import read_location
from studies.exports.osi_messages import FIRST_BUILDING, FIRST_LIGHT, LIGHT_SPEED, LIT, World
from studies.exports.scene import surroundings_of, users_of
from studies.exports.show import clouds
from tests.studies.exports.crowd import NET, UTM

osi_trace = pytest.importorskip("osi3trace.osi_trace")


def read(path: Path, kind: str) -> list[Any]:
    trace = osi_trace.OSITrace(str(path), kind)
    messages = list(trace)
    trace.close()
    return messages


@pytest.fixture(scope="module")
def folder(street: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("osi") / "traces"
    assert main(["export", str(street), "--osi", "--out", str(path)]) == 0
    return path


def truths(folder: Path) -> list[Any]:
    (path,) = folder.glob("*_gt_*.osi")
    return read(path, "GroundTruth")


def test_names_are_those_of_the_convention(folder: Path) -> None:
    names = sorted(path.name for path in folder.iterdir())
    assert len(names) == 4
    for name in names:
        created, kind, osi, protobuf, frames, custom = name.removesuffix(".osi").split("_")
        assert len(created) == len("20210818T150542Z")
        assert (created[8], created[-1]) == ("T", "Z")
        assert osi == "".join(osi_trace_version()[:3])
        assert protobuf.isdigit()
        assert int(frames) == {"gt": 21, "sv": 11}[kind]
        assert custom.startswith("run")
    assert {name.rpartition("_")[2] for name in names} == {
        "run.osi",
        "run-red-car.osi",
        "run-white-van.osi",
        "run-bus.osi",
    }


def osi_trace_version() -> Sequence[str]:
    from importlib.metadata import version  # noqa: PLC0415 - of the package under test

    return version("osi-python").split(".")


def test_the_truth_is_where_everybody_was(folder: Path, street: Path) -> None:
    recording = Recording(street)
    ids, places, headings, velocities, sizes = (
        recording[f"road.vehicle.{name}"]
        for name in ("id", "position", "heading", "velocity", "size")
    )
    told = truths(folder)
    assert len(told) == len(ids)
    for k, truth in enumerate(told):
        stamp = truth.timestamp
        assert stamp.seconds * 10**9 + stamp.nanos == int(ids.times[k])
        assert [each.id.value for each in truth.moving_object] == np.asarray(ids[k]).tolist()
        for row, each in enumerate(truth.moving_object):
            base, place, size = each.base, np.asarray(places[k])[row], np.asarray(sizes[k])[row]
            assert (base.position.x, base.position.y) == tuple(place[:2])
            assert base.position.z == place[2] + size[2] / 2
            assert base.orientation.yaw == np.asarray(headings[k])[row]
            assert (base.velocity.x, base.velocity.y) == tuple(np.asarray(velocities[k])[row])
            dimension = base.dimension
            assert (dimension.length, dimension.width, dimension.height) == tuple(size)
    kinds = [each.type for each in told[0].moving_object]
    first = told[0].moving_object[0]
    assert kinds == [first.TYPE_VEHICLE] * 3 + [first.TYPE_PEDESTRIAN]
    classes = [each.vehicle_classification for each in told[0].moving_object[:3]]
    assert [each.type for each in classes] == [
        first.vehicle_classification.TYPE_MEDIUM_CAR,
        first.vehicle_classification.TYPE_DELIVERY_VAN,
        first.vehicle_classification.TYPE_BUS,
    ]
    assert first.model_reference == "passenger"
    assert list(first.source_reference[0].identifier) == ["red car"]


def test_the_house_stands_where_it_is(folder: Path) -> None:
    (house,) = truths(folder)[3].stationary_object
    assert house.id.value == FIRST_BUILDING
    base = house.base
    assert (base.position.x, base.position.y, base.position.z) == (10.0, 14.0, 6.0)
    assert (base.dimension.length, base.dimension.width, base.dimension.height) == (40, 12, 12)
    corners = {(corner.x, corner.y) for corner in base.base_polygon}
    assert corners == {(x, y) for x in (-20.0, 20.0) for y in (-6.0, 6.0)}
    assert house.classification.type == house.classification.TYPE_BUILDING


def rotation(orientation: Any) -> Array:
    """From OSI's angles to a matrix: roll about x, then pitch about y, then yaw about z."""
    (cz, sz), (cy, sy), (cx, sx) = (
        (math.cos(angle), math.sin(angle))
        for angle in (orientation.yaw, orientation.pitch, orientation.roll)
    )
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    return np.asarray(about_z @ about_y @ about_x)


@pytest.mark.parametrize(("custom", "number"), [("bus", 2), ("red-car", 0)])
def test_reflections_lie_on_what_they_name(
    custom: str, number: int, folder: Path, street: Path
) -> None:
    """From time of flight, ray, mounting and vehicle back to points in the world."""
    series = Recording(street)["scanner.points"]
    (path,) = folder.glob(f"*_sv_*-{custom}.osi")
    views = read(path, "SensorView")
    assert len(views) == len(series) == 11
    named: set[int] = set()
    hit: set[int] = set()
    for k, view in enumerate(views):
        (records,) = [p for s, p in clouds(bytes(series[k])) if s["vehicle"] == number]
        (lidar,) = view.lidar_sensor_view
        assert len(lidar.reflection) == len(lidar.view_configuration.directions) == len(records)
        hit.update(records["instance"].tolist())
        flights = np.array([each.time_of_flight for each in lidar.reflection])
        rays = np.array([(d.x, d.y, d.z) for d in lidar.view_configuration.directions])
        local = rays * (flights * LIGHT_SPEED / 2)[:, None]
        assert np.abs(local - records["position"]).max() < 1e-9
        objects = {each.id.value: each for each in view.global_ground_truth.moving_object}
        host = objects[view.host_vehicle_id.value].base
        mount = view.mounting_position
        at = np.array([mount.position.x, mount.position.y, mount.position.z])
        ground = np.array([host.position.x, host.position.y, host.position.z])
        world = (local @ rotation(mount.orientation).T + at) @ rotation(host.orientation).T + ground
        for place, reflection in zip(world, lidar.reflection, strict=True):
            if not reflection.HasField("object_id"):
                assert abs(place[2]) < 1e-3  # the ground
                continue
            target = reflection.object_id.value
            named.add(target)
            if target == FIRST_BUILDING:
                inside = (place[0] + 10, 30 - place[0], place[1] - 8, 20 - place[1])
                assert min(inside) == pytest.approx(0.0, abs=1e-3)  # on a wall
            else:
                base = objects[target].base
                reach = np.hypot(base.dimension.length, base.dimension.width) / 2 + 0.01
                assert np.hypot(place[0] - base.position.x, place[1] - base.position.y) < reach
    expected = {n if n >= 0 else FIRST_BUILDING - 2 - n for n in hit if n != GROUND}
    assert named == expected
    assert len(named) > 1 or custom == "bus"


def test_signal_strengths_are_decibels_of_the_intensity(folder: Path, street: Path) -> None:
    (path,) = folder.glob("*_sv_*-red-car.osi")
    view = read(path, "SensorView")[0]
    data = bytes(Recording(street)["scanner.points"][0])
    (records,) = [p for s, p in clouds(data) if s["vehicle"] == 0]
    for reflection, intensity in zip(
        view.lidar_sensor_view[0].reflection, records["intensity"].tolist(), strict=True
    ):
        if intensity > 0:
            assert 10 ** (reflection.signal_strength / 10) == pytest.approx(intensity)


def test_lights_hosts_and_the_projection(busy: Path) -> None:
    net = busy / "map.net.xml"
    net.write_text(NET.format(projection=UTM.format(zone=32), offset="-456000.00,-5427000.00"))
    manifest = json.loads((busy / "manifest.json").read_text())
    manifest["files"] = {"streets": {str(net): ""}}
    (busy / "manifest.json").write_text(json.dumps(manifest))
    assert main(["export", str(busy), "--osi"]) == 0
    told = truths(busy / "export" / "osi")
    assert [truth.HasField("host_vehicle_id") for truth in told] == [False, *[True] * 4]
    assert told[2].host_vehicle_id.value == 7
    assert [len(truth.moving_object) for truth in told] == [3] * 5
    projection = read_location(net, None, is_moved=False)
    assert projection is not None
    assert told[0].proj_string == projection.text
    offset = told[0].proj_frame_offset.position
    assert (offset.x, offset.y) == (456000.0, 5427000.0)
    lit = [
        [(b.id.value - FIRST_LIGHT, b.classification.mode == 3) for b in t.traffic_light]
        for t in told
    ]
    red, amber, green = (True, False, False), (False, True, False), (False, False, True)
    second = [green, green, amber, (True, True, False), red]  # the codes 5, 4, 3, 2, 1
    for k, bulbs in enumerate(lit):
        assert [number for number, _ in bulbs] == list(range(6))
        assert tuple(is_on for _, is_on in bulbs) == (*red, *second[k])


def test_without_points_there_is_no_view(busy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(busy), "--osi", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["left_out"] == ["no points of lidars are recorded: there are no SensorViews"]
    assert len(told["files"]) == 1


def test_without_the_bindings_it_is_said_what_to_install(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "osi3.osi_groundtruth_pb2", None)
    assert main(["export", str(run), "--osi"]) == 2
    assert "pip install 'nlosim[osi]'" in capsys.readouterr().err
    assert not (run / "export").exists()


def test_a_sensor_is_mounted_where_it_is_on_its_vehicle(busy: Path) -> None:
    """One to the left and ahead of the middle, turned by half a radian."""
    recording = Recording(busy)
    users, _ = users_of(recording)
    world = World(users, surroundings_of(recording), None)
    snapshot = users.at(2)  # the truck is at (6, 1.5), and turned by 0.6 rad
    ahead, left = np.array([np.cos(0.6), np.sin(0.6)]), np.array([-np.sin(0.6), np.cos(0.6)])
    sensor = np.zeros((), SENSOR)
    sensor["vehicle"], sensor["time"] = 7, 200_000_000
    sensor["position"] = [*(np.array([6.0, 1.5]) + 2.0 * ahead + 0.5 * left), 4.5]
    sensor["heading"], sensor["pitch"], sensor["roll"] = 1.1, 0.1, -0.2
    points = np.zeros(1, POINT)
    points["position"], points["instance"] = [[3.0, 0.0, -4.0]], [8]
    view = world.view(sensor, points, world.truth(snapshot, None), snapshot)
    assert view is not None
    mount = view.mounting_position
    assert (mount.position.x, mount.position.y) == pytest.approx((2.0, 0.5))
    assert mount.position.z == pytest.approx(2.5)  # from the middle of a truck of 4 m
    angles = (mount.orientation.yaw, mount.orientation.pitch, mount.orientation.roll)
    assert angles == pytest.approx((0.5, 0.1, -0.2))
    (ray,) = view.lidar_sensor_view[0].view_configuration.directions
    assert (ray.x, ray.y, ray.z) == pytest.approx((0.6, 0.0, -0.8))
    (reflection,) = view.lidar_sensor_view[0].reflection
    assert reflection.time_of_flight == pytest.approx(10.0 / LIGHT_SPEED)
    assert reflection.object_id.value == 8
    assert not reflection.HasField("signal_strength")
    sensor["vehicle"] = 77
    assert world.view(sensor, points, world.truth(snapshot, None), snapshot) is None


def test_the_right_turn_after_a_stop_is_a_red_light() -> None:
    assert {code: sorted(on) for code, on in LIT.items() if code in (0, 6)} == {
        0: [],
        6: ["COLOR_RED"],
    }
