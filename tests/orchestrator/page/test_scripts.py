"""What the scripts of a page compute: arrays as they were written, curves, layouts, the clock."""

import base64
import itertools
import shlex
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from orchestrator.page.arrays import Arrays
from orchestrator.page.page import SCRIPTS
from tests.scripts import Engine, engine

NEEDED = [
    path
    for path in SCRIPTS
    if path.stem in {"dom", "inflate", "decode", "curves", "clock", "layout", "about"}
]


@pytest.fixture(scope="module")
def page() -> Iterator[Engine]:
    with engine(NEEDED) as found:
        yield found


def inflated(page: Engine, data: bytes) -> bytes:
    letters = base64.b64encode(data).decode()
    return bytes(page.value("Array.from(NLOSIM.inflate(NLOSIM.bytesOf(letters)))", letters=letters))


def deflated(data: bytes, level: int, strategy: int = zlib.Z_DEFAULT_STRATEGY) -> bytes:
    squeeze = zlib.compressobj(level, zlib.DEFLATED, -15, 8, strategy)
    return squeeze.compress(data) + squeeze.flush()


@pytest.mark.parametrize(
    ("folder", "below"),
    [
        ("/runs/red_light-1", ""),
        ("/my runs/it's 5% §", ""),
        ("/out", "runs/1-seed-2"),
        ("/a b", 'runs/"x" $HOME `y`'),
    ],
)
def test_the_command_that_compares_names_the_folder_of_the_page(
    page: Engine, folder: str, below: str
) -> None:
    """However a shell takes it apart."""
    address = Path(folder, "index.html").as_uri().removeprefix("file://")
    where = {"protocol": "file:", "pathname": address}
    said = page.value("NLOSIM.rerun(where, below)", where=where, below=below)
    assert shlex.split(said) == ["nlosim", "rerun", str(Path(folder, below))]
    elsewhere = {"protocol": "http:", "pathname": "/page/1.html"}
    assert page.value("NLOSIM.rerun(elsewhere)", elsewhere=elsewhere) == "nlosim rerun DIR"
    windows = {"protocol": "file:", "pathname": "/C:/runs/a/index.html"}
    assert page.value("NLOSIM.rerun(windows)", windows=windows) == "nlosim rerun C:/runs/a"


@given(data=st.binary(max_size=400), level=st.sampled_from([0, 1, 9]))
def test_inflate_returns_what_was_deflated(page: Engine, data: bytes, level: int) -> None:
    """Level 0 stores."""
    assert inflated(page, deflated(data, level)) == data


@pytest.mark.parametrize("strategy", [zlib.Z_DEFAULT_STRATEGY, zlib.Z_FIXED, zlib.Z_HUFFMAN_ONLY])
def test_inflate_knows_every_kind_of_block(page: Engine, strategy: int) -> None:
    """Fixed and own codes, copies of up to 258 bytes from up to 32 KiB before."""
    rng = np.random.default_rng(1)
    part = rng.integers(0, 40, 20_000, dtype=np.uint8).tobytes()
    data = part + b"\0" * 3000 + part + bytes(range(256))
    assert inflated(page, deflated(data, 9, strategy)) == data


def test_a_page_that_is_cut_short_says_so(page: Engine) -> None:
    letters = base64.b64encode(deflated(b"what is missing " * 9, 9)[:-9]).decode()
    said = page.value(
        "(() => { try { NLOSIM.inflate(NLOSIM.bytesOf(letters)); return 'nothing'; }"
        " catch (error) { return error.message; } })()",
        letters=letters,
    )
    assert said == "the arrays of this page are cut short"


def read(page: Engine, arrays: Arrays, how: str, reference: Any) -> list[float]:
    """What `NLOSIM.Arrays` returns for a reference; null stands for NaN."""
    found: list[float] = page.value(
        "Array.from(new NLOSIM.Arrays(NLOSIM.inflate(NLOSIM.bytesOf(letters)))[how](reference))",
        letters=arrays.letters(),
        how=how,
        reference=reference,
    )
    return found


@pytest.mark.parametrize("dtype", ["u1", "i2", "u2", "i4"])
@pytest.mark.parametrize("deltas", [0, 1, 2, 3])
@given(data=st.data())
def test_whole_numbers_arrive_as_they_were(
    page: Engine, dtype: str, deltas: int, data: st.DataObject
) -> None:
    """The whole range of each type: differences are modulo what it holds."""
    values = data.draw(hnp.arrays(np.dtype(f"<{dtype}"), st.integers(0, 30)))
    arrays = Arrays()
    arrays.add(np.arange(7), "u1")
    reference = arrays.add(values, dtype, deltas=deltas)
    assert read(page, arrays, "array", reference) == values.tolist()


@given(
    values=hnp.arrays(np.float64, st.integers(1, 40), elements=st.floats(-1e6, 1e6)),
    step=st.sampled_from([0.0, 0.01, 100.0]),
)
def test_real_numbers_are_wrong_by_half_a_step_at_most(
    page: Engine, values: Any, step: float
) -> None:
    """A step is what was asked for, or the range over 65532."""
    arrays = Arrays()
    reference = arrays.rounded(values, step)
    found = np.array(read(page, arrays, "numbers", reference))
    assert reference["step"] <= max(step, (values.max() - values.min()) / 65532 * 1.001) or (
        values.max() == values.min()
    )
    rounding = 1e-9 * max(1.0, np.abs(values).max())
    assert np.abs(found - values).max() <= reference["step"] * 0.5000001 + rounding


def test_what_is_not_finite_is_missing(page: Engine) -> None:
    arrays = Arrays()
    reference = arrays.rounded(np.array([np.nan, 1.0, np.inf, 3.0, -np.inf]))
    assert read(page, arrays, "numbers", reference) == [
        None,
        pytest.approx(1.0, abs=1e-4),
        None,
        pytest.approx(3.0, abs=1e-4),
        None,
    ]


def test_equal_arrays_are_kept_once() -> None:
    arrays = Arrays()
    first = arrays.add(np.arange(1000), "i4")
    size = len(arrays.letters())
    assert arrays.add(np.arange(1000), "i4") == first
    assert len(arrays.letters()) == size


@pytest.mark.parametrize(
    ("values", "dtype"), [([256], "u1"), ([-1], "u2"), ([0.5], "i4"), ([2**31], "i4")]
)
def test_numbers_that_do_not_fit_are_refused(values: list[float], dtype: str) -> None:
    with pytest.raises(ValueError, match=f"no `{dtype}`"):
        Arrays().add(np.array(values), dtype)


@given(st.lists(st.integers(0, 9), max_size=12).map(sorted), st.integers(-1, 10))
def test_the_last_place_at_which_numbers_are_not_above(
    page: Engine, ascending: list[int], value: int
) -> None:
    found = page.value("NLOSIM.lastAt(ascending, value)", ascending=ascending, value=value)
    assert found == sum(each <= value for each in ascending) - 1


CURVE = "new NLOSIM.Curve({ times: [0, 1, 3], values: [2, 4, NaN], holds }).at(time)"


@pytest.mark.parametrize(
    ("holds", "time", "expected"),
    [(True, 0.5, 2), (False, 0.5, 3), (False, 1.0, 4), (False, 2.0, 4), (True, 9.0, None)],
)
def test_a_curve_holds_or_goes_straight_on(
    page: Engine, *, holds: bool, time: float, expected: float | None
) -> None:
    """A gap is null in JSON; towards it the value holds."""
    assert page.value(CURVE, holds=holds, time=time) == expected


def test_before_its_first_value_a_curve_has_none(page: Engine) -> None:
    assert page.value(CURVE, holds=True, time=-0.1) is None


def test_curves_of_different_times_share_rows(page: Engine) -> None:
    """A gap is null; where only another curve has a value stands nothing: here, too, null."""
    found = page.value(
        "NLOSIM.aligned([{ times: [0, 2], values: [1, NaN] }, { times: [1, 2], values: [5, 6] }])"
        ".map((column) => column.map((each) => (each === undefined ? 'nothing' : each)))"
    )
    assert found == [[0, 1, 2], [1, "nothing", None], ["nothing", 5, 6]]


def test_curves_that_share_a_unit_share_a_chart_up_to_seven(page: Engine) -> None:
    curves = [{"name": str(k), "unit": "m", "holds": False} for k in range(8)]
    curves += [{"name": "a", "unit": "", "holds": False}, {"name": "b", "unit": "", "holds": True}]
    names = page.value("NLOSIM.charts(curves).map((c) => c.map((e) => e.name))", curves=curves)
    assert names == [["0", "1", "2", "3", "4", "5", "6"], ["7"], ["a"], ["b"]]


@pytest.mark.parametrize(
    ("about", "expected"),
    [
        ({"status": "done"}, "done"),
        ({"status": "done", "ended_early": "he was through"}, "ended early"),
        ({"status": "running"}, "not ended: it goes on, or was killed"),
        ({"status": "interrupted"}, "interrupted"),
        ({"status": None}, "unfinished"),
    ],
)
def test_a_run_that_has_not_ended_does_not_say_that_it_runs(
    page: Engine, about: dict[str, str | None], expected: str
) -> None:
    assert page.value("NLOSIM.ended(about)", about=about) == expected


@pytest.mark.parametrize(
    ("start", "expected"), [(0, ["0 s", "0.1 s", "20 s"]), (100, ["100 s", "100.1 s", "120 s"])]
)
def test_a_chart_tells_the_times_of_the_run(
    page: Engine, start: float, expected: list[str]
) -> None:
    """As the bar of the page does, also where a run does not begin at 0."""
    assert page.value("NLOSIM.moments(start, [0, 0.1, 20])", start=start) == expected


CLOCK = """
(() => {
  const asked = [];
  const clock = new NLOSIM.Clock(10, (next) => asked.push(next));
  const told = [];
  clock.listen((time, playing) => told.push([time, playing]));
  const frame = (now) => { asked.shift()(now); };
  %s
  return told;
})()
"""


def test_time_goes_on_as_fast_as_it_was_asked_to_and_stops_at_the_end(page: Engine) -> None:
    steps = "clock.speed = 2; clock.play(); frame(1000); frame(2000); frame(3500); frame(9000);"
    told = page.value(CLOCK % (steps + "told.push(asked.length);"))
    assert told == [[0, True], [2, True], [5, True], [10, False], 0]


def test_many_changes_before_a_picture_are_one(page: Engine) -> None:
    steps = "clock.seek(3); clock.seek(99); clock.seek(NaN); told.push(asked.length); frame(0);"
    assert page.value(CLOCK % steps) == [1, [10, False]]


def test_who_plays_at_the_end_begins_anew(page: Engine) -> None:
    assert page.value(CLOCK % "clock.seek(10); clock.play(); frame(0);") == [[0, True]]


def layout(page: Engine, names: list[str], pairs: list[tuple[str, str]]) -> Any:
    return page.value(
        "NLOSIM.layout(names.map((name) => ({ name })), pairs.map(([source, target]) =>"
        " ({ source, target })))",
        names=names,
        pairs=pairs,
    )


@given(
    count=st.integers(1, 9),
    links=st.sets(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=16),
)
def test_no_two_boxes_of_a_wiring_overlap_and_lines_go_right(
    page: Engine, count: int, links: set[tuple[int, int]]
) -> None:
    names = [f"c{k}" for k in range(count)]
    pairs = [(names[a], names[b]) for a, b in sorted(links) if a < count and b < count]
    found = layout(page, names, pairs)
    boxes = {box["name"]: box for box in found["boxes"]}
    assert sorted(boxes) == names
    for a, b in itertools.combinations(boxes.values(), 2):
        apart_x = abs(a["x"] - b["x"]) >= a["width"]
        apart_y = abs(a["y"] - b["y"]) >= a["height"]
        assert apart_x or apart_y
    for box in boxes.values():
        assert 0 <= box["x"] <= found["width"] - box["width"]
        assert 0 <= box["y"] <= found["height"] - box["height"]
    for edge in found["edges"]:
        if edge["forward"]:
            assert boxes[edge["target"]]["x"] > boxes[edge["source"]]["x"]
    assert len(found["edges"]) == len(pairs)


def test_connections_between_two_components_are_one_line(page: Engine) -> None:
    found = layout(page, ["a", "b"], [("a", "b"), ("a", "b"), ("b", "a")])
    assert [(edge["forward"], len(edge["connections"])) for edge in found["edges"]] == [
        (True, 2),
        (False, 1),
    ]
