"""Traffic lights: their signals stand where the net has them and show what SUMO shows."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from adapters.sumo.lights import Lights
from adapters.sumo.simulation import Sumo
from orchestrator.signal import Array, Signals
from tests.adapters.red_light import ASSETS
from tests.adapters.sumo_runs import NETS, Float, scene

CODES = {"o": 0, "O": 0, "r": 1, "u": 2, "y": 3, "Y": 3, "g": 4, "G": 5, "s": 6}
"""As the connector `light.state` says it."""

TOWARDS = {"south_in": math.pi / 2, "north_in": -math.pi / 2, "west_in": 0.0, "east_in": math.pi}
"""Headings [rad] of the arms of the red light, towards its middle."""


def array(signals: Signals, name: str) -> Array:
    return np.asarray(signals[f"light.{name}"])


def signals_in(net: Path) -> list[tuple[str, Float]]:
    """Edge and last two vertices of the lane that leads to each signal, shape (2, 2).

    Read from the file, in the order of `linkIndex`; connections of pedestrians are left out.
    """
    root = ET.parse(net).getroot()  # noqa: S314  (of this project)
    shapes = {lane.attrib["id"]: lane.attrib["shape"] for lane in root.iter("lane")}
    found: dict[int, tuple[str, Float]] = {}
    for link in root.iter("connection"):
        edge = link.attrib["from"]
        if "tl" not in link.attrib or edge.startswith(":"):
            continue
        vertices = shapes[f"{edge}_{link.attrib['fromLane']}"].split()[-2:]
        found[int(link.attrib["linkIndex"])] = (
            edge,
            np.array([[float(value) for value in vertex.split(",")] for vertex in vertices]),
        )
    return [found[index] for index in sorted(found)]


class Stated:
    """Stands in for SUMO and its net: lanes and letters as a test says.

    All lanes but `b` end at (3, 4).
    """

    def __init__(self, lanes: dict[str, list[list[str]]]) -> None:
        self._lanes = lanes
        self.letters = {name: "r" * len(those) for name, those in lanes.items()}

    @property
    def net(self) -> "Stated":
        return self

    def lights(self) -> list[str]:
        return sorted(self._lanes)

    def controlled_lanes(self, light: str) -> list[list[str]]:
        return self._lanes[light]

    def lane_shape(self, lane: str) -> Float:
        """The heading is that of the last piece."""
        end = (0.0, 5.0) if lane == "b" else (3.0, 4.0)
        return np.array([(-10.0, 0.0), (0.0, 0.0), end])

    def light_states(self, lights: Sequence[str]) -> list[str]:
        return [self.letters[light] for light in lights]


def of(sumo: Stated) -> Lights:
    return Lights(cast("Sumo", sumo))


def test_every_letter_of_sumo_has_its_code() -> None:
    sumo = Stated({"x": [["a"]] * len(CODES)})
    sumo.letters["x"] = "".join(CODES)
    assert array(of(sumo).signals(), "state").tolist() == list(CODES.values())


def test_lights_follow_by_name_and_signals_that_no_lane_leads_to_are_left_out() -> None:
    """What belongs to one signal stays in one row, whatever is left out before it."""
    sumo = Stated({"y": [["a"], ["b"]], "x": [[], ["b"], [], ["a"]]})
    sumo.letters = {"x": "rgyG", "y": "us"}
    signals = of(sumo).signals()
    assert array(signals, "controller").tolist() == [0, 0, 1, 1]
    assert array(signals, "state").tolist() == [CODES[letter] for letter in "gGus"]
    a, b = (3.0, 4.0), (0.0, 5.0)
    np.testing.assert_array_equal(array(signals, "position"), [b, a, a, b])
    slope = math.atan2(4.0, 3.0)
    expected = [math.pi / 2, slope, slope, math.pi / 2]
    np.testing.assert_allclose(array(signals, "heading"), expected, rtol=1e-15)


def test_what_no_light_changed_is_the_same_object_and_nobody_can_write_to_it() -> None:
    """A state that was given out stays as it was when the lights change."""
    sumo = Stated({"x": [["a"], ["b"]]})
    lights = of(sumo)
    first, second = lights.signals(), lights.signals()
    assert all(first[name] is second[name] for name in first)
    sumo.letters["x"] = "rG"
    third = lights.signals()
    assert array(third, "state").tolist() == [1, 5]
    assert array(first, "state").tolist() == [1, 1]
    changed = {name for name in first if third[name] is not first[name]}
    assert changed == {"light.state"}
    assert not any(np.asarray(value).flags.writeable for value in third.values())


def test_a_scene_without_lights_has_no_signals() -> None:
    signals = of(Stated({})).signals()
    assert array(signals, "position").shape == (0, 2)
    for name in ("state", "controller", "heading"):
        assert array(signals, name).shape == (0,)
    assert {array(signals, name).dtype for name in ("state", "controller")} == {np.dtype(np.int32)}


def test_signals_of_the_red_light_stand_at_the_ends_of_the_arms(sumo: Sumo) -> None:
    """At the stop lines, 8.25 m (main road) or 14.25 m from the middle, towards it."""
    signals = Lights(sumo).signals()
    written = signals_in(ASSETS / "red_light.net.xml")
    assert len(written) == 16
    np.testing.assert_array_equal(array(signals, "position"), [lane[1] for _, lane in written])
    expected = np.array([TOWARDS[edge] for edge, _ in written])
    np.testing.assert_allclose(array(signals, "heading"), expected, atol=1e-12)
    assert set(array(signals, "controller").tolist()) == {0}
    ahead = np.stack([np.cos(expected), np.sin(expected)], axis=-1)
    to_the_middle = -(array(signals, "position") * ahead).sum(axis=1)
    assert set(np.round(to_the_middle, 9)) == {8.25, 14.25}


def test_signals_of_crossings_are_left_out_and_the_others_stand_where_lanes_end(
    tmp_path: Path, loaded: Callable[..., Sumo]
) -> None:
    """The lights of the town have 24 signals, four of which are for persons on foot."""
    signals = Lights(loaded(scene(tmp_path, "town"))).signals()
    written = signals_in(NETS / "town.net.xml")
    assert len(written) == 20
    np.testing.assert_allclose(array(signals, "position"), [lane[1] for _, lane in written])
    way = np.array([lane[1] - lane[0] for _, lane in written])
    expected = np.arctan2(way[:, 1], way[:, 0])
    np.testing.assert_allclose(array(signals, "heading"), expected, atol=1e-12)


@pytest.mark.parametrize("net", [ASSETS / "red_light.net.xml", NETS / "town.net.xml"])
def test_the_states_are_those_of_the_plan_second_by_second(
    tmp_path: Path, loaded: Callable[..., Sumo], net: Path
) -> None:
    """Over more than a cycle; they change with SUMO's lights and with nothing else."""
    plan = [
        (float(phase.attrib["duration"]), phase.attrib["state"])
        for phase in ET.parse(net).getroot().iter("phase")  # noqa: S314  (of this project)
    ]
    ends = np.cumsum([duration for duration, _ in plan])
    config = tmp_path / "plan.sumocfg"
    config.write_text(f'<configuration><net-file value="{net}"/></configuration>')
    simulation, count = loaded(config), len(signals_in(net))
    lights = Lights(simulation)
    before, changes = lights.signals(), 0
    for second in range(round(ends[-1]) + 10):
        simulation.step()  # 50 ms: the light has changed
        signals = lights.signals()
        letters = plan[int(np.searchsorted(ends, second % ends[-1], side="right"))][1][:count]
        assert array(signals, "state").tolist() == [CODES[letter] for letter in letters]
        changes += signals["light.state"] is not before["light.state"]
        before = signals
        for _ in range(19):
            simulation.step()
    assert changes == len(plan)


def test_an_index_that_rules_several_lanes_has_a_signal_at_each_of_them() -> None:
    """All of them show the letter of the index, and change with it."""
    sumo = Stated({"x": [["a", ":w", "b"], ["b"]]})
    sumo.letters["x"] = "Gr"
    lights = of(sumo)
    signals = lights.signals()
    a, b = (3.0, 4.0), (0.0, 5.0)
    np.testing.assert_array_equal(array(signals, "position"), [a, b, b])
    assert array(signals, "controller").tolist() == [0, 0, 0]
    assert array(signals, "state").tolist() == [CODES[letter] for letter in "GGr"]
    sumo.letters["x"] = "yG"
    assert array(lights.signals(), "state").tolist() == [CODES[letter] for letter in "yyG"]


def test_an_index_rules_the_lanes_of_all_its_links_each_once() -> None:
    """SUMO tells of each index the links that it rules: lane, lane behind, lane between."""

    class Ruling:
        @staticmethod
        def getControlledLinks(light: str) -> list[list[tuple[str, str, str]]]:  # noqa: N802  (as SUMO)
            assert light == "middle"
            straight, left = ("b_0", "x_0", ":m_1"), ("b_0", "y_0", ":m_3")
            return [[straight, ("a_0", "x_0", ":m_0"), left], [], [("c_1", "y_0", ":m_2")]]

    sumo = Sumo.__new__(Sumo)
    sumo._lights = Ruling
    assert sumo.controlled_lanes("middle") == [["b_0", "a_0"], [], ["c_1"]]
