"""`nlosim scene show`: a picture of a scene, or of what is around an entity."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.legend import Legend
from matplotlib.text import Annotation

from adapters.traffic.bodies import Body
from adapters.traffic.drawing import View, draw
from orchestrator.cli import main
from orchestrator.palette import GREEN, VERMILLION


def test_a_view_is_a_square_around_its_center_as_far_as_there_is_something() -> None:
    signals = {
        "road.vertex": np.array([[-100.0, -2.0], [100.0, -2.0], [100.0, 2.0], [-100.0, 2.0]]),
        "road.index": np.zeros(4, np.int32),
        "building.vertex": np.zeros((0, 2)),
        "building.index": np.zeros(0, np.int32),
        "vehicle.id": np.array([7]),
        "vehicle.position": np.array([[40.0, 0.0, 0.75]]),
        "vehicle.heading": np.zeros(1),
        "vehicle.size": np.array([[5.0, 2.0, 1.5]]),
        "vehicle.body": np.zeros(1, np.int32),
        "vehicle.lidar": np.zeros(1, np.bool_),
    }
    view = View(center=np.array([40.0, 0.0]), radius=30.0)
    (axes,) = draw(signals, {7: "ego"}, "", view).axes
    margin = 0.03 * 60.0
    assert axes.get_xlim() == pytest.approx((10.0 - margin, 70.0 + margin))
    (whole,) = draw(signals, {7: "ego"}, "").axes
    assert whole.get_xlim() == pytest.approx((-106.0, 106.0))


def test_a_picture_shows_everybody_once_in_the_colour_of_the_legend() -> None:
    """Outlines to scale; circles for lidars, marks for the small, labels for those with names."""
    signals = {
        "road.vertex": np.array([[-500.0, -5.0], [500.0, -5.0], [500.0, 5.0], [-500.0, 5.0]]),
        "road.index": np.zeros(4, np.int32),
        "building.vertex": np.array([[0.0, 9.0], [9.0, 9.0], [9.0, 18.0], [0.0, 18.0]]),
        "building.index": np.zeros(4, np.int32),
        "vehicle.id": np.array([3, 7, 9]),
        "vehicle.position": np.array([[40.0, 0.0, 0.7], [-60.0, 2.0, 0.9], [80.0, 1.0, 1.6]]),
        "vehicle.heading": np.zeros(3),
        "vehicle.size": np.array([[5.0, 2.0, 1.5], [0.5, 0.5, 1.8], [12.0, 2.5, 3.2]]),
        "vehicle.body": np.array([Body.CAR, Body.PEDESTRIAN, Body.CAR], np.int32),
        "vehicle.lidar": np.array([True, False, False]),
        "light.position": np.array([[10.0, -5.0], [20.0, -5.0]]),
        "light.state": np.array([1, 5], np.int32),
    }
    (axes,) = draw(signals, {7: "child"}, "a street").axes
    kinds, around = (each for each in axes.get_children() if isinstance(each, Legend))
    assert [text.get_text() for text in kinds.get_texts()] == ["car (2)", "pedestrian (1)"]
    assert "building" in [text.get_text() for text in around.get_texts()]
    assert axes.get_title(loc="left") == "a street"
    (name,) = axes.texts
    assert isinstance(name, Annotation)
    assert name.get_text() == "child"
    np.testing.assert_allclose(name.xy, (-60.0, 2.0))
    polygons = [each for each in axes.collections if isinstance(each, PolyCollection)]
    road, building, cars, persons = (len(each.get_paths()) for each in polygons)
    assert (road, building, cars, persons) == (1, 1, 2, 1)
    np.testing.assert_allclose(
        sorted(path.get_extents().width for path in polygons[2].get_paths()), [5.0, 12.0]
    )
    marks = [each for each in axes.collections if isinstance(each, PathCollection)]
    places = [np.asarray(each.get_offsets()).tolist() for each in marks]
    lights, *_, small, lidars = places
    assert lights == [[10.0, -5.0], [20.0, -5.0]]
    assert small == [[-60.0, 2.0]]
    assert lidars == [[40.0, 0.0]]
    red, green = np.asarray(marks[0].get_facecolor())
    np.testing.assert_allclose(red, to_rgba(VERMILLION))
    np.testing.assert_allclose(green, to_rgba(GREEN))


def test_a_picture_around_somebody_who_is_not_there_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "scene.png"
    assert main(["scene", "show", "platoon", "--around", "bus", "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert "no entity `bus` is there at 0 s; those that are: blocking, collider, ego" in error
    assert not out.exists()
    assert main(["scene", "show", "platoon", "--around", "ego", "--out", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")


def test_the_picture_is_higher_where_the_legend_has_more_lines() -> None:
    """Of five columns; a line is one of 0.22 inches."""

    def height(kinds: list[Body]) -> float:
        count = len(kinds)
        signals = {
            "road.vertex": np.array([[-60.0, -5.0], [60.0, -5.0], [60.0, 5.0]]),
            "road.index": np.zeros(3, np.int32),
            "building.vertex": np.zeros((0, 2)),
            "building.index": np.zeros(0, np.int32),
            "vehicle.id": np.arange(count),
            "vehicle.position": np.stack(
                [np.linspace(-50.0, 50.0, count), np.zeros(count), np.zeros(count)], axis=1
            ),
            "vehicle.heading": np.zeros(count),
            "vehicle.size": np.full((count, 3), 1.0),
            "vehicle.body": np.array(kinds, np.int32),
            "vehicle.lidar": np.zeros(count, np.bool_),
        }
        return float(draw(signals, {}, "").get_size_inches()[1])

    one, six = [Body.CAR] * 6, list(Body)[:6]
    assert height(six) - height(one) == pytest.approx(0.22)
