"""What the scripts of the top view compute: places, the picture's scale, who heard what."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.page.arrays import Arrays
from orchestrator.page.page import SCRIPTS as PAGE
from studies.top_view.layer import SCRIPTS
from tests.scripts import Engine, engine

NEEDED = [
    *(path for path in PAGE if path.stem in {"inflate", "decode", "curves"}),
    *(
        path
        for path in SCRIPTS
        if path.stem in {"crowd", "camera", "radio", "knowledge", "pointer", "sensing"}
    ),
]
MOST_LINES = 400


@pytest.fixture(scope="module")
def view() -> Iterator[Engine]:
    with engine(NEEDED) as found:
        yield found


@pytest.mark.parametrize("has", [[True, True], [True, False], [False, False]])
def test_a_legend_names_what_somebody_has_or_has_not(view: Engine, has: list[bool]) -> None:
    crowd = "Object.assign(Object.create(NLOSIM.Crowd.prototype), { radio: has, lidar: has })"
    found = view.value(
        f"(({{ hasNoRadio, hasLidar }}) => [hasNoRadio, hasLidar])({crowd})", has=has
    )
    assert found == [not all(has), any(has)]


CAMERA = """
(() => {
  const camera = new NLOSIM.Camera();
  camera.resize(800, 600);
  %s
})()
"""


@given(
    place=st.tuples(st.integers(0, 800), st.integers(0, 600)),
    factor=st.floats(0.1, 10),
)
def test_what_is_under_the_pointer_stays_there_when_zooming(
    view: Engine, place: tuple[int, int], factor: float
) -> None:
    before, after, again = view.value(
        CAMERA % "const a = camera.toWorld(...place); camera.zoom(factor, ...place);"
        "const b = camera.toWorld(...place); return [a, b, camera.toScreen(...b)];",
        place=place,
        factor=factor,
    )
    assert after == pytest.approx(before, abs=1e-9)
    assert again == pytest.approx(place, abs=1e-6)


def test_north_is_up_and_a_metre_is_as_long_both_ways(view: Engine) -> None:
    origin, east, north = view.value(
        CAMERA % "camera.scale = 5; return [camera.toScreen(0, 0), camera.toScreen(10, 0),"
        " camera.toScreen(0, 10)];"
    )
    assert origin == [400, 300]
    assert east == [450, 300]
    assert north == [400, 250]


def test_all_that_there_is_fits_into_the_picture(view: Engine) -> None:
    corners = view.value(
        CAMERA % "camera.fit([-100, -50, 300, 50]);"
        "return [camera.toScreen(-100, -50), camera.toScreen(300, 50)];"
    )
    assert corners[0][0] == pytest.approx(0.04 * 800)
    assert corners[1][0] == pytest.approx(0.96 * 800)
    assert 0 < corners[1][1] < corners[0][1] < 600


def crowd_data(arrays: Arrays) -> dict[str, Any]:
    """Two vehicles at 0, 1 and 2 s; the second is not there at 1 s, so it has two stretches."""
    turn = np.array([0, 1024, 1024, 4000, 40])
    return {
        "ids": arrays.add(np.array([3, 8]), "i4", deltas=1),
        "names": ["ego", ""],
        "kinds": ["sedan", ""],
        "size": arrays.rounded(np.array([4.5, 1.8, 1.5, 10.0, 2.5, 3.0]), 0.01),
        "body": arrays.add(np.array([0, 4]), "u1"),
        "role": arrays.add(np.array([1, 0]), "i4"),
        "radio": arrays.add(np.array([1, 1]), "u1"),
        "lidar": arrays.add(np.array([1, 0]), "u1"),
        "times": {"whole": arrays.add(np.array([0, 1, 2]), "i4", deltas=2), "unit": 1.0},
        "stretches": {
            "vehicle": arrays.add(np.array([0, 1, 1]), "i4", deltas=1),
            "first": arrays.add(np.array([0, 0, 2]), "i4"),
            "count": arrays.add(np.array([3, 1, 1]), "i4"),
        },
        "x": arrays.rounded(np.array([0.0, 10.0, 20.0, 5.0, 6.0]), 0.01, deltas=2),
        "y": arrays.rounded(np.array([0.0, 0.0, 4.0, -5.0, -6.0]), 0.01, deltas=2),
        "heading": arrays.add(turn, "u2", deltas=1),
        "directions": 4096,
        "stride": 1,
    }


CROWD = """
(() => {
  const arrays = new NLOSIM.Arrays(NLOSIM.inflate(NLOSIM.bytesOf(letters)));
  const crowd = new NLOSIM.Crowd(data, ["ego"], arrays);
  const at = (time) => {
    const { n, vehicle, x, y, heading } = crowd.at(time);
    return Array.from({ length: n }, (_, k) => [vehicle[k], x[k], y[k], heading[k]]);
  };
  return %s;
})()
"""


def in_crowd(view: Engine, expression: str) -> Any:
    arrays = Arrays()
    data = crowd_data(arrays)
    return view.value(CROWD % expression, letters=arrays.letters(), data=data)


def test_everybody_goes_straight_from_point_to_point_and_is_gone_between_stretches(
    view: Engine,
) -> None:
    """Half a second on: half the way, half the turn."""
    first, second = in_crowd(view, "[at(0), at(1.5)]")
    assert [row[0] for row in first] == [0, 1]
    assert first[1][1:3] == pytest.approx([5.0, -5.0], abs=0.01)
    assert [row[0] for row in second] == [0]
    assert second[0][1:] == pytest.approx([15.0, 2.0, np.pi / 2], abs=0.01)
    assert first[0][3] == pytest.approx(0.0)


def test_a_turn_is_the_shorter_one(view: Engine) -> None:
    """Headings of 0 and a quarter of a turn; the way between goes through an eighth."""
    ((_, _, _, heading), *_) = in_crowd(view, "at(0.5)")
    assert heading == pytest.approx(np.pi / 4, abs=2e-3)


@pytest.mark.parametrize(("before", "after", "quarter"), [(4000, 100, 4049), (100, 4000, 51)])
def test_a_turn_over_east_does_not_go_round(
    view: Engine, before: int, after: int, quarter: int
) -> None:
    """From 8 to 9 degrees on the one side of east to the other one."""
    arrays = Arrays()
    data = crowd_data(arrays)
    headings = np.array([before, after, after, 0, 0])
    data["heading"] = arrays.add(headings, "u2", deltas=1)
    found = view.value(CROWD % "at(0.25)[0][3]", letters=arrays.letters(), data=data)
    assert np.cos(found - quarter * 2 * np.pi / 4096) == pytest.approx(1.0, abs=1e-6)


def test_a_speed_is_way_over_time(view: Engine) -> None:
    speeds = in_crowd(view, "[crowd.speed(0, 0.2), crowd.speed(0, 1.7), crowd.speed(1, 1.2)]")
    assert speeds == [pytest.approx(10.0, abs=0.02), pytest.approx(np.hypot(10, 4), abs=0.02), None]


def test_names_are_those_of_the_scenario_or_numbers(view: Engine) -> None:
    assert in_crowd(view, "[crowd.title(0), crowd.title(1), crowd.kind(1)]") == [
        "ego (3)",
        "vehicle 8",
        "truck",
    ]


RADIO = """
(() => {
  const arrays = new NLOSIM.Arrays(NLOSIM.inflate(NLOSIM.bytesOf(letters)));
  const radio = new NLOSIM.Radio(data, arrays);
  return %s;
})()
"""


def radio_data(arrays: Arrays) -> dict[str, Any]:
    """Three packets: BSMs of 1 at 0.1 s and 0.2 s, and sensor data of 1 by 2 to 0 at 0.15 s.

    0 receives the first, loses the second to interference, and hears both hops of the third.
    """

    def times(*seconds: float) -> dict[str, Any]:
        ticks = np.rint(np.array(seconds) * 1e6).astype(np.int64)
        return {"whole": arrays.add(ticks, "i4", deltas=2), "unit": 1e-6}

    def add(*values: int) -> Any:
        return arrays.add(np.array(values), "i4")

    fates = np.zeros((6, 3), np.int64)
    fates[0] = [1, 2, 0]
    fates[2] = [0, 0, 1]
    return {
        "packets": {
            "id": add(0, 1, 5), "first": 100, "time": times(0.1, 0.15, 0.2),
            "source": add(1, 1, 1), "destination": add(-1, 0, -1),
            "route": add(-1, 2, -1, -1, -1, -1), "size": add(300, 200, 300),
            "kind": add(0, 2, 0), "fates": arrays.add(fates, "u2"),
        },
        "sent": {
            "packet": add(0, 1, 1, 2), "wait": add(0, 0, 10, 0), "late": add(0, 0, 1000, 0),
            "duration": add(400, 400, 400, 400), "hop": add(0, 0, 1, 0), "fate": add(0, 0, 0, 0),
            "transmitter": add(1, 1, 2, 1),
        },
        "heard": {
            "receivers": [0], "ends": [4], "packet": add(0, 1, 1, 2), "hop": add(0, 0, 1, 0),
            "transmitter": add(1, 1, 2, 1),
            "power": arrays.rounded(np.array([-70.0, -90.0, -60.0, -80.0]), 0.1),
            "snir": arrays.rounded(np.array([20.0, np.nan, 30.0, 1.0]), 0.1),
            "code": add(0 | 32, 1 | 1 << 3, 0 | 32, 2 | 2 << 3 | 32),
        },
        "full": [0], "partly": [], "stride": 1, "outcomes": "RNCBTU", "fate_words": ["sent"],
    }  # fmt: skip


def in_radio(view: Engine, expression: str) -> Any:
    arrays = Arrays()
    data = radio_data(arrays)
    return view.value(RADIO % expression, letters=arrays.letters(), data=data)


@pytest.mark.parametrize(
    ("time", "expected"),
    [(0.1003, []), (0.1005, [[1, 0]]), (0.16, [[2, 2], [1, 1]]), (0.25, [[1, 3], [2, 2]])],
)
def test_a_link_is_the_newest_frame_of_each_transmitter_once_it_has_ended(
    view: Engine, time: float, expected: list[list[int]]
) -> None:
    """A frame of 0.4 ms that starts at 0.1 s is heard at 0.1004 s."""
    assert in_radio(view, f"Array.from(radio.links(0, {time}, 0.2))") == expected


def test_what_was_lost_is_not_known(view: Engine) -> None:
    """Of 1, 0 knows what the first packet and the relayed one said, not what the last one said."""
    assert in_radio(view, "Array.from(radio.known(0, 0.12))") == [[1, 0]]
    assert in_radio(view, "Array.from(radio.known(0, 9))") == [[1, 2]]


def test_a_packet_has_its_way_its_hops_and_its_fate(view: Engine) -> None:
    way, of_two, heard, outcome = in_radio(
        view,
        "[radio.way(1), radio.sentOf[2] - radio.sentOf[1], radio.addressed.get('1 1 0'),"
        " radio.outcome(3)]",
    )
    assert way == [1, 2, 0]
    assert of_two == 2
    assert heard == 2
    assert outcome == 2
    assert in_radio(view, "radio.hearers(1).map(({ k }) => k)") == [1, 2]


@pytest.mark.parametrize(("every", "expected"), [("false", [1]), ("true", [0, 1])])
def test_frames_fly_from_their_start(view: Engine, every: str, expected: list[int]) -> None:
    """BSMs only where they are asked for."""
    assert sorted(in_radio(view, f"radio.frames(0.1505, 0.1, {every})")) == expected


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_are_short_and_set_names_as_text_only(script: Any) -> None:
    text = script.read_text()
    assert len(text.splitlines()) < MOST_LINES
    assert "innerHTML" not in text


@pytest.mark.parametrize(
    ("box", "scanned", "owner"),
    [
        ([9.0, -1.0, 11.0, 1.0], 1.0, 0),  # around its middle
        ([12.0, -0.2, 12.6, 0.2], 1.0, 0),  # its front: the middle is 2.3 m ahead, 0.05 m outside
        ([13.0, -0.2, 13.4, 0.2], 1.0, -1),  # 0.95 m before it
        ([9.0, -1.0, 11.0, 1.0], 0.0, -1),  # then it was elsewhere
        ([4.0, -9.4, 6.0, -9.0], 0.0, 1),  # 4.2 m behind the middle of a truck of 10 m, along it
        ([0.8, -5.2, 1.2, -4.8], 0.0, -1),  # 4 m beside it: it is 2.5 m wide
    ],
)
def test_an_object_is_of_whom_its_middle_was_in_when_it_was_seen(
    view: Engine, box: list[float], scanned: float, owner: int
) -> None:
    """Bodies, with half a metre around them; the first stands at (10, 0) at 1 s, heading east."""
    arrays = Arrays()
    data = crowd_data(arrays)
    data["heading"] = arrays.add(np.array([0, 0, 0, 1024, 1024]), "u2", deltas=1)
    objects = {
        "name": "a.objects",
        "told": False,
        "times": {"whole": arrays.add(np.array([1]), "i4", deltas=2), "unit": 1.0},
        "ends": arrays.add(np.array([1]), "i4"),
        "sensor": arrays.add(np.array([0]), "i4"),
        "scanned": {"whole": arrays.add(np.array([round(scanned)]), "i4", deltas=2), "unit": 1.0},
        "position": arrays.rounded((np.array(box[:2]) + box[2:]) / 2, 0.01),
        "angle": arrays.rounded(np.zeros(1), 0.01),
        "size": arrays.rounded(np.array(box[2:]) - box[:2], 0.01),
    }
    found = view.value(
        CROWD % "new NLOSIM.Objects(objects, arrays).owner(crowd, 0)",
        letters=arrays.letters(),
        data=data,
        objects=objects,
    )
    assert found == owner


DRAWN = """
((objects) => {
  const calls = [];
  const context = new Proxy({}, {
    get: (_, name) => (...given) => calls.push([name, ...given]),
    set: () => true,
  });
  const camera = { apply: () => {}, scale: 4 };
  const view = { camera, belongs: () => true, observer: 0, selected: null };
  NLOSIM.Sensing.prototype.drawObjects.call({ objects: [objects] }, context, view, 1);
  return calls.filter(([name]) => name !== "setLineDash");
})({ told: false, sensor: [0, 5], rows: () => [0, 2], position: [3, 4, 8, 9], angle: [0.5, 0],
     size: [4, 2, 1, 1] })
"""


def test_a_box_is_drawn_turned_about_its_middle(view: Engine) -> None:
    """With 0.3 m around it, of one's own sensor only; what is drawn next is not turned."""
    assert view.value(DRAWN) == [
        ["save"],
        ["translate", 3, 4],
        ["rotate", 0.5],
        ["strokeRect", -2.3, -1.3, 4.6, 2.6],
        ["restore"],
    ]


def test_one_knows_by_messages_by_its_sensor_and_by_what_others_told(view: Engine) -> None:
    """How old each is [s]; of itself nothing, of others' sensors nothing."""
    own = "{ told: false, scanned: [8], seen: (_, __, s) => new Map(s === 0 ? [[4, 0]] : []) }"
    others = "{ told: true, scanned: [7], seen: () => new Map([[0, 0], [4, 0], [5, 0]]) }"
    heard = "packets: { time: [0, 9.5] }, heard: { packet: [0, 1] }"
    radio = f"{{ known: () => new Map([[5, 1]]), {heard} }}"
    found = view.value(
        f"Array.from(NLOSIM.knowledge({{ crowd: null, radio: {radio}, objects: [{own}, {others}],"
        " belongs: () => true }, 0, 10))"
    )
    assert found == [[5, {"message": 0.5, "told": 3}], [4, {"sees": 2, "told": 3}]]


@given(
    x=st.floats(-1e4, 1e4),
    y=st.floats(-1e4, 1e4),
    half=st.floats(0.5, 100.0),
    heading=st.floats(-7.0, 7.0),
)
def test_a_blind_zone_is_a_square_along_the_heading(
    view: Engine, x: float, y: float, half: float, heading: float
) -> None:
    """Along it and across, each corner is half a side from the middle."""
    corners = view.value("NLOSIM.square(x, y, half, heading)", x=x, y=y, half=half, heading=heading)
    offset = np.array(corners) - [x, y]
    axes = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    expected = half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    np.testing.assert_allclose(offset @ axes, expected, atol=1e-9 * (1e4 + half))


ZONES = """
(() => {
  const drawn = [];
  const ignore = () => {};
  const context = { beginPath: ignore, closePath: ignore, fill: ignore, stroke: ignore, lineTo: (...place) => drawn.push(place) };
  const zones = [{ name: "zones", times: [0, 1], ends: [1, 3], center: [9, 9, 3, 4, 5, 6], range: [9, 2, 1] }];
  const sensing = Object.assign(Object.create(NLOSIM.Sensing.prototype), { zones });
  const crowd = { at: () => ({ row: [-1, 0], heading: [heading] }) };
  const view = { camera: { apply: ignore, scale: 1 }, belongs: () => true, observer, crowd };
  sensing.drawZones(context, view, 1.5);
  return [drawn, [NLOSIM.square(3, 4, 2, shown), NLOSIM.square(5, 6, 1, shown)].flat()];
})()
"""  # noqa: E501 - a script


@pytest.mark.parametrize(("observer", "heading", "shown"), [(1, 0.7, 0.7), (0, 0.7, 0), (-1, 2, 0)])
def test_blind_zones_are_drawn_along_the_heading_of_whoever_observes(
    view: Engine, observer: int, heading: float, shown: float
) -> None:
    """Those of the newest look alone; who is not there any more has none."""
    drawn, expected = view.value(ZONES, observer=observer, heading=heading, shown=shown)
    assert drawn == expected
    assert len(drawn) == 8
