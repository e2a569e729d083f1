"""SUMO's own output, replayed, is what SUMO says of its vehicles and persons."""

import gzip
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import libsumo
import numpy as np
import pytest

from adapters.replay.kinds import CLASSES, DEFAULT_TYPES
from adapters.sumo.road import read_road
from adapters.sumo.scene import read_buildings
from adapters.sumo.simulation import Sumo
from adapters.traffic.geometry import wrap
from orchestrator.errors import ComponentTypeError
from tests.adapters.red_light import SCENE
from tests.adapters.traces import Sample, array, entered, replay, states, write_csv

STEPS = 300
ROUTES = """
<routes>
  <vType id="car" vClass="passenger" length="4.4" width="1.7" height="1.65"/>
  <flow id="through" type="car" begin="0" end="30" period="2" from="south_in" to="north_out"
        departLane="best" departSpeed="max"/>
  <flow id="turning" begin="0" end="30" period="3" from="south_in" to="east_out"
        departLane="best" departSpeed="max"/>
  <flow id="lorry" type="box_truck" begin="1.3" end="30" period="5" from="north_in" to="south_out"
        departLane="best" departSpeed="max"/>
  <person id="walker" depart="2"><walk from="south_in" to="east_out"/></person>
  <person id="rider" depart="3"><ride from="south_in" to="north_out" lines="taxi"/></person>
  <vehicle id="taxi" type="car" depart="triggered"><route edges="south_in north_out"/></vehicle>
  <person id="waiting" depart="4"><ride from="south_in" to="north_out" lines="none"/></person>
</routes>
"""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What SUMO says of somebody.

    Attributes:
        front: the middle of the front [m].
        heading: counter-clockwise from east [rad].
        size: length, width, height [m].
    """

    front: tuple[float, float]
    heading: float
    speed: float
    size: tuple[float, float, float]


def everybody() -> Mapping[str, Seen]:
    """Everybody who is a body of its own, by name."""
    found = {}
    for domain in (libsumo.vehicle, libsumo.person):
        for name in domain.getIDList():
            if domain is libsumo.person and libsumo.person.getVehicle(name):
                continue
            found[name] = Seen(
                front=domain.getPosition(name),
                heading=float(wrap(np.radians(90.0 - domain.getAngle(name)))),
                speed=domain.getSpeed(name),
                size=(domain.getLength(name), domain.getWidth(name), domain.getHeight(name)),
            )
    return found


def start(*options: str) -> None:
    libsumo.start(["sumo", "-c", str(SCENE), "--no-step-log", "--no-warnings", *options])


def test_a_replay_shows_what_sumo_says(tmp_path: Path) -> None:
    """To half the last decimal of SUMO's files: 5 mm, 5 mm/s, and 0.005 degrees."""
    routes, file = tmp_path / "all.rou.xml", tmp_path / "fcd.xml.gz"
    routes.write_text(ROUTES)
    files = ("-r", str(routes), "--fcd-output", str(file))
    start("--step-length", "0.1", *files, "--ignore-route-errors")  # walking where none may walk
    try:
        expected = []
        for _ in range(STEPS):
            libsumo.simulationStep()
            expected.append(everybody())
    finally:
        libsumo.close()

    types = tmp_path / "types.xml"
    scene = (SCENE.parent / "red_light.typ.xml").read_text()
    own = '<vType id="car" length="4.4" width="1.7" height="1.65"/></additional>'
    types.write_text(scene.replace("</additional>", own))
    names: dict[int, str] = {}
    component = replay(file, types_file=types)
    for signals, those in zip(states(component, "0.1", STEPS - 1), expected, strict=True):
        names |= {number: name for number, name, _ in entered(signals)}
        present = [names[number] for number in array(signals, "id").tolist()]
        assert sorted(present) == sorted(those)
        for row, name in enumerate(present):
            seen = those[name]
            ahead = np.array([np.cos(seen.heading), np.sin(seen.heading)])
            center = np.array(seen.front[:2]) - 0.5 * seen.size[0] * ahead
            error = array(signals, "position")[row, :2] - center
            # of a coordinate 5 mm, and of the angle what it moves a centre 4 m behind the front
            assert np.abs(error).max() <= 0.005 + 4.0 * np.radians(0.005) + 1e-9
            turned = wrap(array(signals, "heading")[row] - np.array(seen.heading))
            assert abs(turned) <= np.radians(0.005) + 1e-9
            speed = np.hypot(*array(signals, "velocity")[row])
            assert speed == pytest.approx(seen.speed, abs=0.005 + 1e-9)
            assert array(signals, "size")[row] == pytest.approx(seen.size)
    assert {"walker", "waiting", "taxi"} < set(names.values())
    assert "rider" not in names.values()  # the whole time in the taxi
    with gzip.open(file, "rt") as written:
        assert 'person id="rider"' in written.read()
    assert len(names) > 20


def test_degrees_of_sumo_are_refused(tmp_path: Path) -> None:
    """A net in Munich; the same traffic in metres is shown."""
    net, routes = tmp_path / "geo.net.xml", tmp_path / "all.rou.xml"
    text = (SCENE.parent / "red_light.net.xml").read_text()
    projection = 'projParameter="+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"'
    offset = re.sub(r'netOffset="[^"]*"', 'netOffset="-691221.38,-5333620.73"', text)
    net.write_text(re.sub(r'projParameter="[^"]*"', projection, offset))
    routes.write_text(
        '<routes><flow id="f" end="9" period="2" from="south_in" to="north_out"/></routes>'
    )
    files = {name: tmp_path / f"{name}.xml" for name in ("false", "true")}
    for is_geodetic, file in files.items():
        options = ["--fcd-output", str(file), "--fcd-output.geo", is_geodetic, "--end", "9"]
        libsumo.start(["sumo", "-n", str(net), "-r", str(routes), "--no-step-log", *options])
        try:
            for _ in range(9):
                libsumo.simulationStep()
        finally:
            libsumo.close()
    assert len(list(states(replay(files["false"]), "1", 2))) == 3
    expected = (
        r"true.xml:\d+:9: `x` and `y` are degrees: they change by 0.0000\d\d for a metre driven"
    )
    with pytest.raises(ComponentTypeError, match=expected):
        replay(files["true"])


def test_surroundings_are_those_of_sumo(tmp_path: Path, sumo: Sumo) -> None:
    file = write_csv(tmp_path / "a.csv", [Sample(id="a", time=0.0)])
    component = replay(
        file,
        net=SCENE.parent / "red_light.net.xml",
        buildings=SCENE.parent / "red_light.poly.xml",
    )
    (found,) = states(component, "0.1", 0)
    road, buildings = read_road(sumo.net), read_buildings(sumo, 10.0)
    vertex = np.asarray(found["road.vertex"], np.float64)
    np.testing.assert_allclose(vertex, road.vertex, atol=1e-9)
    np.testing.assert_array_equal(found["road.index"], road.index)
    heights, corners = (np.asarray(found[f"building.{name}"]) for name in ("height", "vertex"))
    assert sorted(heights.tolist()) == sorted(buildings.height.tolist())
    assert sorted(corners.tolist()) == sorted(buildings.vertex.tolist())


def test_sizes_of_classes_are_those_of_sumo(tmp_path: Path) -> None:
    types = tmp_path / "types.xml"
    declared = "".join(f'<vType id="{name}" vClass="{name}"/>' for name in CLASSES)
    types.write_text(f"<additional>{declared}</additional>")
    start("-a", str(types))
    try:
        for name in (*CLASSES, *DEFAULT_TYPES):
            own = libsumo.vehicletype
            size = (own.getLength(name), own.getWidth(name), own.getHeight(name))
            assert size == pytest.approx(CLASSES[DEFAULT_TYPES.get(name, name)]), name
    finally:
        libsumo.close()
