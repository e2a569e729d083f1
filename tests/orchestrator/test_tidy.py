"""Tidy tables: every recorded number is there once, in the row of its time and its element."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.recording import tidy
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.recording.tidy import Lost, TidyTable, chosen, tidy_tables
from orchestrator.signal import Array
from tests.orchestrator.cars import CARS, SAMPLES
from tests.recordings import output, record


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return record(tmp_path / "run", CARS, SAMPLES)


def whole(table: TidyTable) -> dict[str, Array]:
    lost = Lost.nothing()
    parts = list(table.blocks(lost))
    assert not lost.said
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def tables(recording: Recording) -> dict[str, TidyTable]:
    return {each.name: each for each in tidy_tables(recording, recording.signals).tables}


@pytest.mark.parametrize("rows", [1, 3, 1 << 16])
def test_every_number_is_in_the_row_of_its_time_and_element(
    rows: int, recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tidy, "ROWS", rows)
    cars = whole(tables(recording)["source-car"])
    assert list(cars) == ["time", "car", "car.far", "car.place[0]", "car.place[1]"]
    told = list(
        zip(*(cars[name].tolist() for name in cars), strict=True),
    )
    assert told == [
        (k / 10, ident, far, x, y)
        for k, each in enumerate(SAMPLES)
        for ident, far, (x, y) in zip(
            np.asarray(each["car.id"]).tolist(),
            np.asarray(each["car.far"]).tolist(),
            np.asarray(each["car.place"]).tolist(),
            strict=True,
        )
    ]
    plain = whole(tables(recording)["source"])
    assert list(plain) == ["time", "gains[0]", "gains[1]", "gains[2]", "speed", "word"]
    assert plain["gains[1]"].tolist() == [k + 0.25 for k in range(7)]
    assert plain["word"].tolist() == [f"wörd {k}" for k in range(7)]


def test_elements_of_two_axes_and_of_long_ones_have_indices(recording: Recording) -> None:
    pairs = whole(tables(recording)["source-car-radio"])
    assert list(pairs) == ["time", "car_index", "radio_index", "pair"]
    expected = [
        (k / 10, i, j, float(2 * i + j))
        for k in range(7)
        for i, j in itertools.product(range(k % 3), range(2))
    ]
    assert list(zip(*(each.tolist() for each in pairs.values()), strict=True)) == expected
    assert pairs["pair"].dtype == np.float32
    field = whole(tables(recording)["source-5-4"])
    assert list(field) == ["time", "index_0", "index_1", "field"]
    at = (field["time"] == 0.3) & (field["index_0"] == 2) & (field["index_1"] == 1)
    assert field["field"][at].tolist() == [2 * 4 + 1 + 3]
    assert len(field["field"]) == 7 * 20


def test_units_and_what_tells_rows_apart(recording: Recording) -> None:
    table = tables(recording)["source-car"]
    assert table.keys == ("time", "car")
    assert dict(table.units) == {
        "time": "s",
        "car": "1",
        "car.far": "1",
        "car.place[0]": "m",
        "car.place[1]": "m",
    }
    fixed = tables(recording)["source-fixed"]
    assert {k: v.tolist() for k, v in whole(fixed).items()} == {
        "time": [0.0],
        "size[0]": [4.0],
        "size[1]": [2.0],
    }


def test_what_has_no_columns_is_said(recording: Recording) -> None:
    found = tidy_tables(recording, recording.signals)
    assert found.left_out == (
        "`source.blob` is left out: binary (application/octet-stream) has no columns",
    )
    assert {n for t in found.tables for n in t.signals} == set(recording.signals) - {"source.blob"}


@given(time=st.integers(0, 2**53))
def test_the_time_in_seconds_tells_the_nanosecond(time: int) -> None:
    column = np.array([time], np.int64) / 1e9
    assert round(column[0] * 1e9) == time


def test_signals_are_chosen_by_patterns(recording: Recording) -> None:
    assert chosen(recording, ["source.car.*", "*.speed"]) == (
        "source.car.far",
        "source.car.id",
        "source.car.place",
        "source.speed",
    )
    with pytest.raises(RecordingError, match=r"`source.sped` is recorded; did you mean `source.s"):
        chosen(recording, ["source.sped"])


SAMPLE_COUNT = 100


def test_lost_samples_are_left_out_and_said(tmp_path: Path) -> None:
    """Noise does not compress: half of the blocks are before the damage."""
    rng = np.random.default_rng(1)
    noise = [{"car.id": np.arange(9000), "car.x": rng.random(9000)} for _ in range(SAMPLE_COUNT)]
    connectors = {"car.id": output("car", dtype=np.int64), "car.x": output("car", unit="m")}
    recording = record(tmp_path / "run", connectors, noise)
    part = tmp_path / "run/signals/source/car.x.zst"
    data = bytearray(part.read_bytes())
    data[len(data) // 2] ^= 255
    part.write_bytes(data)
    (table,) = tidy_tables(recording, recording.signals).tables
    lost = Lost.nothing()
    parts = list(table.blocks(lost))
    kept = {round(10 * t) for each in parts for t in np.unique(each["time"])}
    assert 0 < lost.samples < SAMPLE_COUNT
    assert len(kept) == SAMPLE_COUNT - lost.samples
    (said,) = lost.said
    assert said.startswith("`source-car` is left out from ")
    assert f"`{part}` is damaged at byte" in said
    values = np.concatenate([each["car.x"] for each in parts])
    expected = np.concatenate([np.asarray(noise[k]["car.x"]) for k in sorted(kept)])
    assert np.array_equal(values, expected)


@pytest.mark.parametrize("length", [17, 20, 300])
def test_elements_along_one_long_axis_have_indices(tmp_path: Path, length: int) -> None:
    values = [np.arange(float(length)) + 100 * k for k in range(4)]
    found = record(tmp_path, {"long": output(length)}, [{"long": each} for each in values])
    table = whole(tables(found)[f"source-{length}"])
    assert list(zip(*(each.tolist() for each in table.values()), strict=True)) == [
        (k / 10, i, number) for k, each in enumerate(values) for i, number in enumerate(each)
    ]
