"""Tables that are played back, and written: what was written is what was played."""

import importlib
import importlib.util
import re
from fractions import Fraction
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from adapters.tables import TableSink, TableSource
from adapters.tables.content import MOST_PROBLEMS, read
from orchestrator.campaign.work import Work, perform
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError, ParameterError, ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.table_files import NO_PARQUET, Format, read_table, write_table
from orchestrator.testing import check_component
from tests.orchestrator.files import change

MS = 1_000_000

TABLE = """\
time [ms], speed [km/h], open
0, 36, false
100, 72, true
250, 18, true
"""

SCENARIO = """\
schema: 1
title: A table
time: {{stop: 400 ms}}
components:
  source: {{type: table-source, step: 50 ms, parameters: {{file: in.csv{source}}}}}
  sink:
    type: table-sink
    step: 50 ms
    parameters: {{folder: ., file: out{suffix}, columns: ["v [m/s]", open, "late [m/s]"]}}
connections:
  - {{from: source.speed, to: sink.v}}
  - {{from: source.open, to: sink.open}}
  - {{from: source.speed, to: sink.late, delay: 100 ms}}
"""

COMMAS = "columns are separated by `,`"
FORMATS: list[Format] = ["csv"]
if importlib.util.find_spec("pyarrow") is not None:
    FORMATS.append("parquet")


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize(
    ("options", "speeds"),
    [
        ("", [10, 10, 20, 20, 20, 5, 5, 5, 5]),
        (", interpolation: linear", [10, 15, 20, 15, 10, 5, 5, 5, 5]),
    ],
)
def test_a_table_goes_through_a_run_with_its_units(
    tmp_path: Path, suffix: str, options: str, speeds: list[float]
) -> None:
    (tmp_path / "in.csv").write_text(TABLE)
    path = tmp_path / "table.yaml"
    path.write_text(SCENARIO.format(source=options, suffix=f".{suffix}"))
    assert main(["check", str(path)]) == 0
    assert main(["run", str(path), "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]) == 0
    found = read_table(tmp_path / f"out.{suffix}")
    assert list(found) == ["time [s]", "v [m/s]", "open", "late [m/s]"]
    assert found["time [s]"].tolist() == [k / 20 for k in range(9)]
    assert found["v [m/s]"] == pytest.approx(speeds, rel=1e-15)
    assert found["late [m/s]"] == pytest.approx([0, 0, *speeds[:-2]], rel=1e-15)
    assert found["open"].tolist() == ([0, 0] + [1] * 7 if not options else [0, 0.5] + [1] * 7)


@pytest.mark.parametrize("suffix", FORMATS)
@given(
    rows=st.lists(
        st.tuples(st.integers(1, 10**12), st.floats(-1e300, 1e300)), min_size=1, max_size=8
    )
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
def test_what_is_written_is_read_to_the_bit(
    tmp_path: Path, suffix: str, rows: list[tuple[int, float]]
) -> None:
    times = np.cumsum([gap for gap, _ in rows])
    values = np.array([value for _, value in rows])
    path = tmp_path / f"table.{suffix}"
    write_table({"time [ns]": times, "x [m]": values}, path)
    content, problems = read(path, "time")
    assert content is not None, problems
    assert content.times.tolist() == times.tolist()
    assert [c.tobytes() for c in content.columns.values()] == [(values + 0.0).tobytes()]


@given(t=st.integers(0, 250), interpolation=st.sampled_from(["hold", "linear"]))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_value_is_that_of_the_row_before_or_on_the_line(
    tmp_path: Path, t: int, interpolation: Literal["hold", "linear"]
) -> None:
    (tmp_path / "in.csv").write_text(TABLE)
    source = TableSource(
        TableSource.Parameters(
            file=tmp_path / "in.csv", interpolation=interpolation, beyond="error"
        )
    )
    source.setup(t * MS, np.random.default_rng(0))
    found = float(source.outputs()["speed"])
    rows = [(0, 36), (100, 72), (250, 18)]
    k = max(k for k, (when, _) in enumerate(rows) if when <= t)
    (a, va), (b, vb) = rows[k], rows[min(k + 1, 2)]
    exact = (
        va + Fraction(vb - va) * Fraction(t - a, max(b - a, 1))
        if interpolation == "linear"
        else Fraction(va)
    )
    assert abs(Fraction(found) - exact) <= Fraction(1, 10**12)


def test_beyond_the_table_is_an_error_where_it_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "in.csv").write_text(TABLE)
    path = tmp_path / "table.yaml"
    path.write_text(SCENARIO.format(source=", beyond: error", suffix=".csv"))
    assert main(["run", str(path), "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]) == 3
    said = capsys.readouterr().err
    assert "component `source` at t = 0.25 s: " in said
    assert "the table is from 0 s to 0.25 s, and there is nothing for 0.3 s" in said
    assert len(read_table(tmp_path / "out.csv")["v [m/s]"]) == 6


def test_both_keep_the_contract(tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text(TABLE)
    check_component(
        TableSource(TableSource.Parameters(file=tmp_path / "in.csv")), steps=3, h=50 * MS, seed=1
    )
    sink = TableSink.Parameters(folder=tmp_path, file="out.csv", columns=("a",))
    check_component(TableSink(sink), steps=3, h=50 * MS, seed=1)


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        ("", ["1:1: the file is empty; write a heading"]),
        ("time,v\n", ["1:1: there are no rows beneath the heading"]),
        ("tme,v\n0,1\n", ["1:1: there is no column `time` with the times; did you mean `tme`?"]),
        (
            "time;v\n0;1\n",
            [f"1:1: there is no column `time` with the times; did you mean `time;v`?; {COMMAS}"],
        ),
        ("time [m],v\n0,1\n", ["1:1: `time` has the unit `m`, which is no time; write `[s]`"]),
        (
            "time,v [kmh],v,v,\n0,1,2,3,4\n",
            [
                "1:6: `v`: `kmh` is not a unit; did you mean `km/h`?",
                "1:16: there is a column `v` already; rename one",
                "1:18: a column has no name",
            ],
        ),
        (
            "time,v\n0,1\n1,a\n2\n1,3\n3,\n4,inf\n",
            [
                "3:3: expected a number, got `a`",
                "4:1: expected 2 fields as in the heading, got 1",
                "6:3: there is no number",
                "7:3: a number must be finite, got inf",
            ],
        ),
        ("time,v\n0,1\n0,2\n", ["3:1: the time 0 is not after the one in the row before"]),
        ('time,v\n0,"1\n', ["2:3: a quote is not closed in this line"]),
        ("time,v\n0,\xff\n", ["2:1: byte 0xff is not UTF-8"]),
    ],
)
def test_every_problem_of_a_file_is_said_at_its_place(
    tmp_path: Path, text: str, problems: list[str]
) -> None:
    path = tmp_path / "in.csv"
    path.write_bytes(text.encode("latin-1"))
    content, found = read(path, "time")
    assert content is None
    assert [f"{p.where.line}:{p.where.column}: {p.what}" for p in found] == problems


def test_a_scenario_says_the_problems_of_its_tables(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "in.csv").write_text("time,speed [km/h],open\n0,1,x\n1,y,0\n")
    path = tmp_path / "table.yaml"
    path.write_text(SCENARIO.format(source="", suffix=".csv"))
    assert main(["check", str(path)]) == 2
    said = "".join(capsys.readouterr())
    assert "in.csv:2:5: expected a number, got `x`" in said
    assert "in.csv:3:3: expected a number, got `y`" in said


def test_no_more_problems_are_told_than_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    path.write_text("time,v\n" + "x,1\n" * (MOST_PROBLEMS + 7))
    _, found = read(path, "time")
    assert len(found) == MOST_PROBLEMS + 1
    assert found[-1].what == "and 7 more like these"


@pytest.mark.parametrize(
    ("file", "columns", "problem"),
    [
        ("out.txt", ("a",), "`file`: expected the name of a file, `.csv` or `.parquet`, got"),
        ("a/out.csv", ("a",), "`file`: expected the name of a file"),
        ("out.csv", (), "`columns`: name one column at least"),
        ("out.csv", ("a", "a [m]"), "`columns.1`: there is a column `a` already"),
        ("out.csv", ("time",), "`columns.0`: there is a column `time` already"),
        ("out.csv", ("a [kmh]",), "`columns.0`: `a`: `kmh` is not a unit; did you mean `km/h`?"),
    ],
)
def test_a_sink_refuses_what_it_cannot_write(
    tmp_path: Path, file: str, columns: tuple[str, ...], problem: str
) -> None:
    with pytest.raises(ParameterError) as error:
        TableSink(TableSink.Parameters(folder=tmp_path, file=file, columns=columns))
    assert problem in str(error.value)


def test_parquet_needs_its_package_and_csv_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adapters.tables.sink.has_parquet", lambda: False)
    TableSink(TableSink.Parameters(folder=tmp_path, file="out.csv", columns=("a",)))
    with pytest.raises(ParameterError, match="file") as error:
        TableSink(TableSink.Parameters(folder=tmp_path, file="out.parquet", columns=("a",)))
    assert NO_PARQUET in str(error.value)


def test_the_example_of_the_manual_runs(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "tables.md").read_text()
    for kind, name in (("csv", "drive.csv"), ("yaml", "tables.yaml")):
        (block,) = re.findall(rf"```{kind}\n(.*?)```", page, re.DOTALL)
        (tmp_path / name).write_text(block)
    assert (
        main(
            [
                "run",
                str(tmp_path / "tables.yaml"),
                "--no-figure",
                "--out",
                str(tmp_path / "r"),
                "--quiet",
            ]
        )
        == 0
    )
    speeds = [10, 15, 20, 15, 10, 5, 5, 5, 5]
    assert read_table(tmp_path / "r" / "log.csv")["v [m/s]"] == pytest.approx(speeds, rel=1e-15)


def sink_scenario(folder: Path, *changes: tuple[str, str]) -> Path:
    (folder / "in.csv").write_text(TABLE)
    path = folder / "tables.yaml"
    path.write_text(SCENARIO.format(source="", suffix=".csv"))
    change(path, *changes)
    return path


OWN = ("folder: ., ", "")


def test_every_run_writes_its_own_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs of an experiment, kept, and one that is not."""
    monkeypatch.setenv("NLOSIM_THREADS", "1")
    path = sink_scenario(tmp_path, OWN)
    for stop in (200, 400):
        keep, overrides = str(tmp_path / f"{stop}"), (f"time.stop={stop} ms",)
        work = Work(scenario=str(path), overrides=overrides, keep=keep, scratch=None)
        assert perform(work).error is None
    rows = [len(read_table(tmp_path / f"{stop}" / "out.csv")["open"]) for stop in (200, 400)]
    assert rows == [5, 9]
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    work = Work(scenario=str(path), overrides=(), keep=None, scratch=str(scratch))
    assert perform(work).error is None
    assert list(scratch.iterdir()) == []
    assert not (tmp_path / "out.csv").exists()


def test_a_table_that_all_runs_would_write_is_refused(tmp_path: Path) -> None:
    sink_scenario(tmp_path)
    experiment = tmp_path / "all.yaml"
    metrics = "metrics: {late: {signal: source.speed}}"
    experiment.write_text(f"schema: 1\nscenario: tables.yaml\nseeds: 2\n{metrics}\n")
    with pytest.raises(ScenarioError) as error:
        load_experiment(experiment)
    (problem,) = error.value.problems
    assert f"all runs of an experiment would write `{tmp_path / 'out.csv'}`" in problem.what
    assert (Path(problem.where.file).name, problem.where.line) == ("tables.yaml", 6)
    change(tmp_path / "tables.yaml", OWN)
    assert len(load_experiment(experiment).runs()) == 2


@pytest.mark.parametrize("changes", [(), (OWN,)])
def test_two_sinks_do_not_write_one_file(
    tmp_path: Path, changes: tuple[tuple[str, str], ...], capsys: pytest.CaptureFixture[str]
) -> None:
    path = sink_scenario(tmp_path, *changes)
    text = path.read_text()
    (sink,) = re.findall(r"  sink:\n.*\n.*\n.*\n", text)
    path.write_text(text.replace(sink, sink + sink.replace("sink:", "other:")))
    assert main(["check", str(path)]) == 2
    assert f"{path}:10:3: components.other: writes `" in capsys.readouterr().out


def test_a_sink_in_another_process_cannot_write_here(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Always, or where a transport is asked for."""
    marked = ("type: table-sink", "type: table-sink\n    process: on-request")
    path = sink_scenario(tmp_path, marked, OWN)
    out = ["--out", str(tmp_path / "out"), "--quiet", "--no-figure"]
    said = "8:14: components.sink: writes into the directory of the run, which is here; remove"
    assert main(["run", str(path), "--transport", "loopback", *out]) == 2
    assert said in capsys.readouterr().err
    assert main(["check", str(path)]) == 0
    assert said in capsys.readouterr().out
    assert main(["run", str(path), *out]) == 0
    assert len(read_table(tmp_path / "out" / "out.csv")["open"]) == 9
    change(path, ("on-request", "true"))
    for command in (["check", str(path)], ["run", str(path), *out]):
        assert main(command) == 2
        printed = capsys.readouterr()
        assert said in printed.out + printed.err


def test_a_sink_that_nobody_tells_where_to_write_says_so() -> None:
    sink = TableSink(TableSink.Parameters(file="out.csv", columns=("a",)))
    with pytest.raises(ComponentTypeError, match=r"where to write `out.csv`; give `folder`"):
        sink.setup(0, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("row", "column", "what"),
    [
        ("1e18,1", 1, "the time 1e18 does not fit into 64-bit nanoseconds"),
        ("-1e300,1", 1, "the time -1e300 does not fit into 64-bit nanoseconds"),
        (f"1,{'1' * 200_000}", 1, "cannot be read: field larger than field limit"),
    ],
)
def test_a_row_beyond_all_bounds_is_told(tmp_path: Path, row: str, column: int, what: str) -> None:
    path = tmp_path / "in.csv"
    path.write_text(f"time [s],x\n{row}\n")
    (problem,) = read(path, "time")[1]
    assert (problem.where.line, problem.where.column) == (2, column)
    assert problem.what.startswith(what)


def test_a_parquet_file_whose_names_are_no_text_is_told(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow", reason="the extra `parquet` is not installed")
    path = tmp_path / "in.parquet"
    importlib.import_module("pyarrow.parquet").write_table(
        pyarrow.table({"time [s]": [0.0], "speed": [1.0]}), path, store_schema=False
    )
    path.write_bytes(path.read_bytes().replace(b"speed", b"sp\xff\xff\xff"))
    (problem,) = read(path, "time")[1]
    assert problem.what.startswith("cannot be read as Parquet: ")
