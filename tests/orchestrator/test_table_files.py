"""Tables in CSV and Parquet files, and read into data frames."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import frame, frames, metrics, table_files, tables_of
from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.scenario.build import load_scenario
from orchestrator.table_files import (
    MissingParquetError,
    chosen,
    has_parquet,
    read_table,
    unit_of,
    write_tables,
)

COURSE = "measures={way: {type: course, signal: car.vehicle.x}}"
TABLE = {
    "link": np.array(["LOS", "NLOSb"]),
    "from_m": np.array([0.0, 0.1 + 0.2]),
    "latency_ms": np.array([1.5, np.nan]),
    "sent_kbit_s": np.array([1e-300, 7.0]),
    "time_s": np.array([0.05, 0.1]),
    "time_ns": np.array([50_000_000, 2**53 + 1]),
    "received": np.array([0, 3]),
}
UNITS = ["1", "m", "ms", "kbit/s", "s", "ns", "1"]


def test_the_ending_of_a_name_says_the_unit() -> None:
    assert [unit_of(name) for name in TABLE] == UNITS


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_is_read_back_bit_for_bit(suffix: str, tmp_path: Path) -> None:
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    (path,) = write_tables({"made": TABLE}, tmp_path / "folder", [suffix])  # type: ignore[list-item]
    assert path == tmp_path / "folder" / f"made.{suffix}"
    again = read_table(path)
    assert list(again) == list(TABLE)
    for name, column in TABLE.items():
        np.testing.assert_array_equal(again[name], column)
        assert again[name].dtype.kind == column.dtype.kind


def test_a_table_without_rows_is_read_back(tmp_path: Path) -> None:
    empty = {name: column[:0] for name, column in TABLE.items()}
    for path in write_tables({"made": empty}, tmp_path, chosen(None)):
        assert {name: len(column) for name, column in read_table(path).items()} == dict.fromkeys(
            TABLE, 0
        )


def test_columns_of_parquet_files_have_units_and_nulls(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    (path,) = write_tables({"made": TABLE}, tmp_path, ["parquet"])
    schema = parquet.read_schema(path)
    assert [schema.field(name).metadata[b"unit"].decode() for name in TABLE] == UNITS
    table = parquet.read_table(path)
    assert table.column("latency_ms").to_pylist() == [1.5, None]
    assert str(schema.field("time_ns").type) == "int64"


@pytest.mark.parametrize("texts", [["", "a", "äöü €", "b\0c", ""], ["x"], []])
def test_texts_are_in_parquet_as_arrow_itself_writes_them(texts: list[str], tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    arrow = pytest.importorskip("pyarrow")
    column = np.array(texts, dtype=np.str_)
    (path,) = write_tables({"made": {"name": column}}, tmp_path, ["parquet"])
    found = parquet.read_table(path).column("name").combine_chunks()
    assert found.equals(arrow.array(texts, arrow.string()))
    assert read_table(path)["name"].tolist() == texts


def test_pandas_reads_what_was_written(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="data frames need pandas")
    pytest.importorskip("pyarrow")
    (path,) = write_tables({"made": TABLE}, tmp_path, ["parquet"])
    read = pandas.read_parquet(path)
    assert read["latency_ms"].isna().tolist() == [False, True]
    assert read["from_m"].tolist() == TABLE["from_m"].tolist()


def test_a_run_is_two_lines_away_from_data_frames(scenario_file: Path, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="data frames need pandas")
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", COURSE, "--out", str(out), "--quiet"]) == 0
    made = frames(out)["way-values"]
    assert isinstance(made, pandas.DataFrame)
    assert made.attrs["units"] == {"time_ns": "ns", "value": "1"}
    assert len(made) == metrics(out)["measures.way.samples"] == 21
    assert np.isnan(made["value"][0])
    series = Recording(out)["car.vehicle.x"]
    signal = frame(series)
    assert signal.attrs["unit"] == series.unit
    np.testing.assert_array_equal(signal["car.vehicle.x"], series.values)
    np.testing.assert_allclose(signal.index, series.times * 1e-9)
    assert list(tables_of(out)) == ["way-values"]


def test_what_has_no_results_says_so(scenario_file: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"has no `metrics.json`; `nlosim report` makes it"):
        metrics(tmp_path)
    with pytest.raises(RecordingError, match=r"has no tables; `nlosim report .* --measures all`"):
        tables_of(tmp_path)


def test_formats_are_those_that_the_scenario_names(scenario_file: Path, tmp_path: Path) -> None:
    for said, suffixes in (("[csv]", {".csv"}), ("[parquet]", {".parquet"})):
        if said == "[parquet]" and not has_parquet():
            continue
        out = tmp_path / said[1:-1]
        arguments = ["run", str(scenario_file), "--set", COURSE, "--set", f"tables={said}"]
        assert main([*arguments, "--out", str(out), "--quiet"]) == 0
        assert {path.suffix for path in (out / "measures").iterdir()} == suffixes
        assert main(["report", str(out)]) == 0
        assert {path.suffix for path in (out / "measures").iterdir()} == suffixes
    assert main(["report", str(tmp_path / "csv"), "--parquet"]) == (0 if has_parquet() else 2)


def test_without_pyarrow_parquet_is_refused_where_it_is_asked_for(
    scenario_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(table_files, "has_parquet", lambda: False)
    monkeypatch.setattr("orchestrator.scenario.build.has_parquet", lambda: False)
    assert chosen(None) == ("csv",)
    with pytest.raises(MissingParquetError, match=r"pip install 'nlosim\[parquet\]'"):
        chosen(["parquet"])
    text = scenario_file.read_text()
    title = "title: Two units"
    scenario_file.write_text(text.replace(title, f"{title}\ntables: [csv, parquet]"))
    with pytest.raises(ScenarioError, match=r"yaml:3:15: tables\[1\]: `parquet` needs `pyarrow`"):
        load_scenario(scenario_file)
    scenario_file.write_text(text)
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", COURSE, "--out", str(out), "--quiet"]) == 0
    assert {path.suffix for path in (out / "measures").iterdir()} == {".csv"}
    capsys.readouterr()
    assert main(["report", str(out), "--parquet"]) == 2
    assert "`parquet` needs `pyarrow`, which is not installed" in capsys.readouterr().err
