"""The figure of a red-light run: who relays is in the picture, one quantity per axis."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fmus.messages.records import LINKS, RECEPTION, frame, unframe
from studies.red_light import figure, top_view
from studies.red_light.metrics import compute
from studies.red_light.traces import Traces
from tests.figures.laws import drawn_by, problems
from tests.studies.red_light.test_metrics import TENTH, Samples, heard_in, recording

pytestmark = pytest.mark.filterwarnings("ignore:constrained_layout not applied")


def picture(traces: Traces, monkeypatch: pytest.MonkeyPatch) -> Figure:
    (found,) = drawn_by(
        lambda: figure.draw(traces, compute(traces), Path("unused.png")), monkeypatch
    )
    return found


def entries(axes: Axes) -> list[str]:
    legend = axes.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def with_links(k: int) -> Traces:
    """The known run, all of whose receptions are of the class `LINKS[k]`."""
    heard = [unframe("RCPT", data, RECEPTION).copy() for data in heard_in(recording())]
    for rows in heard:
        rows["link"] = k
    return Traces(
        recording() | {"channel.receptions": Samples([frame("RCPT", rows) for rows in heard])}
    )


def test_it_fulfils_the_laws_of_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    assert problems(picture(Traces(recording()), monkeypatch)) == []


def test_an_axis_has_one_quantity(monkeypatch: pytest.MonkeyPatch) -> None:
    _, *lines = picture(Traces(recording()), monkeypatch).axes
    labels = [axes.get_ylabel().replace("\n", " ") for axes in lines]
    assert labels == [
        "speed of the ego [km/h]",
        "gap to the collider [m]",
        "power at the ego [dBm]",
        "sensor data for the ego",
    ]


def test_both_ends_of_every_link_are_in_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """However far the relay is: 300 m to the north, the picture reaches 12 m beyond it."""
    traces = Traces(recording())
    moment = 2 * TENTH
    links = top_view.links_before(traces, moment)
    assert links
    now = traces.scene(moment)
    far = int(np.flatnonzero(now.ids == next(iter(links))[1])[0])
    now.position[far, 1] = 300.0
    assert top_view.view_of(now, links).y1 == pytest.approx(312.0)
    scene = picture(traces, monkeypatch).axes[0]
    low, high = scene.get_ylim()
    ends = {vehicle for pair in links for vehicle in pair}
    now = traces.scene(moment)
    assert all(low < y < high for y in now.position[np.isin(now.ids, list(ends)), 1])


@pytest.mark.parametrize("k", range(len(LINKS)))
def test_the_legend_lists_the_classes_of_links_that_are_drawn(
    k: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, *lines = picture(with_links(k), monkeypatch).axes
    listed = [name for name in entries(scene) if name.startswith("sensor data")]
    assert listed == [f"sensor data, {LINKS[k]}"]
    assert {name.rpartition(" ")[2] for name in entries(lines[2])} == {LINKS[k]}


def test_marks_of_each_class_of_links_are_filled_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the mark says by which way a packet came."""
    looks = set()
    for k in range(len(LINKS)):
        powers = picture(with_links(k), monkeypatch).axes[3]
        marked = [line for line in powers.lines if not str(line.get_label()).startswith("_")]
        looks |= {(str(line.get_marker()), line.get_fillstyle()) for line in marked}
    assert {fill for _, fill in looks} == {"full", "none", "bottom"}
    assert len(looks) == 2 * len(LINKS)


def test_the_vehicles_that_matter_are_named_in_the_picture(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = picture(Traces(recording()), monkeypatch).axes[0]
    names = {text.get_text() for text in scene.texts}
    assert {"ego 1", "collider 2", "sharer 3"} <= names
