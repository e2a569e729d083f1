"""Pictures of scenes: the legend counts whom they show, names are inside and hide nobody."""

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from adapters.traffic.bodies import Body
from adapters.traffic.drawing import View, draw
from orchestrator.drawing import styled
from orchestrator.signal import Signals
from tests.figures.laws import all_legends, problems


def street(places: list[tuple[float, float]], bodies: list[Body]) -> Signals:
    """A street of 200 m from west to east with vehicles of 4.5 m on it."""
    count = len(places)
    return {
        "road.vertex": np.array([[-100.0, -5.0], [100.0, -5.0], [100.0, 5.0], [-100.0, 5.0]]),
        "road.index": np.zeros(4, np.int32),
        "building.vertex": np.array([[0.0, 9.0], [9.0, 9.0], [9.0, 18.0], [0.0, 18.0]]),
        "building.index": np.zeros(4, np.int32),
        "vehicle.id": np.arange(count),
        "vehicle.position": np.array([(*place, 0.7) for place in places]),
        "vehicle.heading": np.zeros(count),
        "vehicle.size": np.tile([4.5, 1.8, 1.5], (count, 1)),
        "vehicle.body": np.array(bodies, np.int32),
        "vehicle.lidar": np.arange(count) == 0,
    }


def listed(figure: Figure) -> list[str]:
    return [text.get_text() for legend in all_legends(figure) for text in legend.get_texts()]


def laid_out(figure: Figure) -> Axes:
    with styled():
        figure.draw_without_rendering()
    (axes,) = figure.axes
    return axes


def test_every_kind_of_road_user_is_told_apart_without_colours_where_it_has_a_hatch() -> None:
    """Cars, SUVs, vans, buses, trucks: those whose outlines are alike."""
    bodies = [Body.CAR, Body.SUV, Body.VAN, Body.BUS, Body.TRUCK]
    figure = draw(street([(10.0 * k, 0.0) for k in range(5)], bodies), {}, "a street")
    laid_out(figure)
    assert problems(figure) == []


def test_the_legend_counts_those_who_are_seen() -> None:
    signals = street([(0.0, 0.0), (10.0, 0.0), (80.0, 0.0)], [Body.CAR, Body.CAR, Body.BUS])
    assert listed(draw(signals, {}, "all")) == [
        "car (2)", "bus (1)", "road", "building", "vehicle with lidar",
    ]  # fmt: skip
    near = draw(signals, {}, "some", View(center=np.array([5.0, 0.0]), radius=30.0))
    assert listed(near)[:2] == ["car (2)", "road"]


@pytest.mark.parametrize("x", [-99.0, 0.0, 99.0])
def test_names_are_inside_the_picture_wherever_their_bearers_are(x: float) -> None:
    figure = draw(street([(x, 0.0)], [Body.CAR]), {0: "somebody"}, "a street")
    axes = laid_out(figure)
    assert problems(figure) == []
    (name,) = axes.texts
    box = name.get_window_extent()
    assert axes.bbox.x0 <= box.x0
    assert box.x1 <= axes.bbox.x1


def test_a_name_is_below_where_somebody_is_just_above() -> None:
    """5 m in a picture that is 24 m high; 20 m to the side is far enough."""
    names = {0: "lower", 1: "upper"}
    over = laid_out(draw(street([(0.0, -4.0), (2.0, -2.0)], [Body.CAR] * 2), names, ""))
    beside = laid_out(draw(street([(0.0, -4.0), (20.0, -2.0)], [Body.CAR] * 2), names, ""))
    for axes, sides in ((over, ("top", "baseline")), (beside, ("baseline", "baseline"))):
        assert tuple(text.get_verticalalignment() for text in axes.texts) == sides


def test_both_legends_begin_where_the_axis_does_and_nothing_of_them_is_cut() -> None:
    figure = draw(street([(0.0, 0.0), (10.0, 0.0)], [Body.CAR, Body.BUS]), {}, "a street")
    axes = laid_out(figure)
    boxes = [legend.get_window_extent() for legend in all_legends(figure)]
    assert [box.x0 for box in boxes] == pytest.approx([axes.bbox.x0] * 2)
    assert boxes[1].y1 <= boxes[0].y0
    assert boxes[1].y0 >= -1.0  # [pixel]
