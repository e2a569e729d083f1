"""Files of recorded links: what is read, and what is said about those that cannot be."""

import sys
from pathlib import Path

import numpy as np
import pytest

from fmus.channel.stand_ins.table import TableError
from fmus.channel.stand_ins.trace_file import (
    UNKNOWN_DELAY,
    OutcomeTrace,
    PerTrace,
    read_names,
    read_trace,
)
from orchestrator.errors import ComponentTypeError

NAMES = {"v24": 24, "v7": 7}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "links.csv"


def problems(path: Path, text: str | bytes) -> list[str]:
    """What is said about a file with this text; each begins with its place, without the path."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(TableError) as caught:
        read_trace(path, NAMES, 0)
    return [line.removeprefix(f"{path}:") for line in str(caught.value).splitlines()]


def rates(path: Path, text: str, time_offset: int = 0) -> PerTrace:
    path.write_text(text)
    trace = read_trace(path, NAMES, time_offset)
    assert isinstance(trace, PerTrace)
    return trace


def outcomes(path: Path, text: str) -> OutcomeTrace:
    path.write_text(text)
    trace = read_trace(path, NAMES, 0)
    assert isinstance(trace, OutcomeTrace)
    return trace


def test_error_rates_are_sorted_by_link_and_keep_what_else_is_known(file: Path) -> None:
    trace = rates(
        file,
        "\ufeff# a remark\n"
        "receiver, time, per, transmitter, power_dbm, snir_db, link\n"
        "\n"
        "7, 0.5, 0.25, 3, -80, , NLOSv\n"
        "3, 0, 1, v7, , 12.5, \n"
        "7, 1e0, 0, 3, nan, 1, LOS\n",
    )
    assert trace.per.tolist() == [0.25, 0.0, 1.0]
    np.testing.assert_array_equal(trace.samples.power_dbm, [-80, np.nan, np.nan])
    np.testing.assert_array_equal(trace.samples.snir_db, [np.nan, 1, 12.5])
    assert trace.samples.link.tolist() == [1, 0, 0]
    found = [trace.samples.rows.at(t, 3, np.array([7]))[0] for t in (499_999_999, 500_000_000)]
    assert found == [-1, 0]


def test_outcomes_may_share_a_time_and_lack_a_delay(file: Path) -> None:
    trace = outcomes(
        file,
        "time,transmitter,receiver,outcome,delay\n"
        "0.1,1,2,R,0.0015\n0.1,1,2,T,\n0.123456789,1,2,U,0\n",
    )
    assert trace.outcome.tolist() == [0, 4, 5]
    assert trace.delay.tolist() == [1_500_000, UNKNOWN_DELAY, 0]
    rows = trace.samples.rows.nearest(123_456_789, 1, np.array([2, 9]), 0, bytes(3))
    assert rows.tolist() == [2, -1]


def test_the_offset_moves_the_recording(file: Path) -> None:
    text = "time,transmitter,receiver,per\n1700000000.5,1,2,1\n"
    trace = rates(file, text.replace("1700000000.5", "3.5"), -3_000_000_000)
    rows = trace.samples.rows
    assert rows.at(499_999_999, 1, np.array([2])).tolist() == [-1]
    assert rows.at(500_000_000, 1, np.array([2])).tolist() == [0]
    unix = rates(file, text, -1_700_000_000 * 10**9)  # seconds since 1970 in a log
    assert unix.samples.rows.at(500_000_000, 1, np.array([2])).tolist() == [0]


def test_a_file_without_rows_is_an_empty_recording(file: Path) -> None:
    assert len(rates(file, "time,transmitter,receiver,per\n").samples.rows) == 0
    assert len(outcomes(file, "time,transmitter,receiver,outcome\n").samples.rows) == 0


def test_every_problem_of_a_file_is_named_at_its_cell(file: Path) -> None:
    found = problems(
        file,
        "# a remark\n"
        "time,transmitter,receiver,per,link\n"
        "0.0,1,2,1.5,LOS\n"
        '0.1,"v24",v9,nan,\n'
        "x,1,1,-0.1,nlos\n"
        "0.3,1,2\n"
        "inf,-4,2.5,,\n",
    )
    no_vehicle = "is no number of a vehicle, and no name in the file of `vehicles`"
    assert found == [
        "3:9: `per`: `1.5` is no number between 0 and 1",
        f"4:11: `receiver`: `v9` {no_vehicle}; there are: v24, v7",
        "4:14: `per`: `nan` is no number between 0 and 1",
        "5:1: `time`: `x` is no number between -4e+09 and 4e+09",
        "5:5: `receiver`: is the transmitter itself",
        "5:7: `per`: `-0.1` is no number between 0 and 1",
        "5:12: `link`: `nlos` is unknown; there are: LOS, NLOSb, NLOSv",
        "6:1: 3 cells, but there are 5 columns",
        "7:1: `time`: `inf` is no number between -4e+09 and 4e+09",
        f"7:5: `transmitter`: `-4` {no_vehicle}; there are: v24, v7",
        f"7:8: `receiver`: `2.5` {no_vehicle}; there are: v24, v7",
        "7:12: `per`: an empty cell is no number between 0 and 1",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time,transmitter,receiver\n", "1:1: has neither of the columns `per` and `outcome`"),
        ("per,outcome\n", "1:1: has both of the columns `per` and `outcome`; it needs one"),
        ("# only a remark\n\n", "1:1: cannot be read: there is no line that names the columns"),
        ("", "1:1: cannot be read: there is no line that names the columns"),
        ("per,per\n", "1:1: cannot be read: the column `per` stands twice"),
        ("\n\ntime,receiver,per\n", "3:1: the column `transmitter` is missing"),
        ("time,transmitter,receiver,per,powr\n", "1:31: there is no column `powr`; did you mean"),
        (b"time,per\n\xff\xfe\n", "1:1: cannot be read: it is not UTF-8 text"),
        ('time,transmitter,receiver,per\n"1,2\n', "2:1: is no line of a CSV file"),
        ("time,transmitter,receiver,outcome\n0,1,2,r\n", "2:7: `outcome`: `r` is unknown; there"),
        ("time,transmitter,receiver,outcome\n0,1,2,\n", "2:7: `outcome`: an empty cell is unknown"),
        (
            "time,transmitter,receiver,outcome,delay\n0,1,2,R,-1\n",
            "2:9: `delay`: `-1` is no number between 0 and 1000",
        ),
        (
            "time,transmitter,receiver,per,snir_db\n0,1,2,0,-inf\n",
            "2:9: `snir_db`: `-inf` is no finite number",
        ),
        (
            "time,transmitter,receiver,per\n2,1,2,0\n0,2,1,0\n2,1,2,0\n",
            "4:1: `time`: 2 s does not follow the 2 s of this link in line 2; the times of a link",
        ),
        (
            "time,transmitter,receiver,outcome\n2,1,2,R\n2,1,2,R\n1,1,2,R\n",
            "4:1: `time`: 1 s does not follow the 2 s of this link in line 3",
        ),
    ],
)
def test_a_file_is_refused_at_the_place_of_its_problem(
    file: Path, text: str | bytes, expected: str
) -> None:
    (found,) = problems(file, text)
    assert found.startswith(expected)


def test_names_need_a_file_of_names(file: Path) -> None:
    file.write_text("time,transmitter,receiver,per\n0,v1,2,0\n")
    with pytest.raises(
        TableError, match="`v1` is no number of a vehicle, and there is no file `ve"
    ):
        read_trace(file, {}, 0)


def test_a_file_full_of_problems_shows_the_first_and_counts_the_rest(file: Path) -> None:
    found = problems(file, "time,transmitter,receiver,per\n" + "0,1,2,7\n" * 1000)
    assert len(found) == 21
    assert found[0].startswith("2:7: ")
    assert found[19].startswith("21:7: ")
    assert found[20] == "... and 980 more problems in this file"


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"nowhere.csv:1:1: cannot be read: No such file"):
        read_trace(tmp_path / "nowhere.csv", {}, 0)


def test_names_of_vehicles(file: Path) -> None:
    file.write_text("name,id\nv0,3\nv1,17\n")
    assert read_names(file) == {"v0": 3, "v1": 17}


def test_names_are_checked(file: Path) -> None:
    file.write_text("name,id\nv0,3\nv0,x\n,4\n")
    with pytest.raises(TableError) as caught:
        read_names(file)
    assert [line.removeprefix(f"{file}:") for line in str(caught.value).splitlines()] == [
        "3:1: `name`: `v0` stands twice",
        (
            "3:4: `id`: `x` is no number of a vehicle, and there is no file `vehicles` of names; "
            "write a number, or give names there"
        ),
        "4:1: `name`: is empty",
    ]


def test_parquet_without_pyarrow_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    (tmp_path / "links.parquet").touch()
    with pytest.raises(ComponentTypeError, match=r"pip install 'nlosim\[parquet\]'; or use a CSV"):
        read_trace(tmp_path / "links.parquet", {}, 0)


def test_parquet_with_lists_or_records_in_its_cells_is_refused(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow", reason="needs the extra `parquet`")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {"time": [0.0, 1.0], "per": [[0.1], [0.2]], "link": [{"x": 1}, {"x": 2}]}
    path = tmp_path / "links.parquet"
    parquet.write_table(arrow.table(columns), path)
    with pytest.raises(TableError) as caught:
        read_trace(path, {}, 0)
    first, second = str(caught.value).splitlines()
    assert first.startswith(f"{path}:1:2: the column `per` holds list<")
    assert second.startswith(f"{path}:1:3: the column `link` holds struct<x: int64>; write one")


def test_parquet_is_read_and_checked_like_csv(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow", reason="needs the extra `parquet`")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {
        "time": [0.0, 1.0],
        "transmitter": ["v24", "v24"],
        "receiver": [7, 7],
        "per": [0.5, None],
        "link": ["NLOSb", None],
    }
    path = tmp_path / "links.parquet"
    parquet.write_table(arrow.table(columns), path)
    with pytest.raises(TableError, match="parquet:2:4: `per`: an empty cell is no number between"):
        read_trace(path, NAMES, 0)
    parquet.write_table(arrow.table(columns | {"per": [0.5, 1.0]}), path)
    trace = read_trace(path, NAMES, 0)
    assert isinstance(trace, PerTrace)
    assert trace.per.tolist() == [0.5, 1.0]
    assert trace.samples.link.tolist() == [2, 0]
    assert trace.samples.rows.at(10**9, 24, np.array([7])).tolist() == [1]
    path.write_bytes(b"time,per\n")
    with pytest.raises(TableError, match=r"links.parquet:1:1: cannot be read: "):
        read_trace(path, NAMES, 0)
