"""`nlosim fmu run` and `nlosim fmu compare`."""

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from adapters.fmi.command.reading import read_results
from adapters.fmi.command.table import Results, draw, lines_of_text, summary, write_results
from adapters.fmi.component_type import FmuComponentType
from adapters.fmu_command import add_command
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.table_files import has_parquet
from tests.adapters.fmu.descriptions import changed
from tests.commands import executed


def execute(*words: str | Path) -> Outcome:
    return executed(add_command, "fmu", *map(str, words))


def run(fmu: Path, *words: str | Path) -> Outcome:
    return execute("run", fmu, "--quiet", *words)


def table(path: Path) -> dict[str, list[float]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    words = {"True": 1.0, "False": 0.0}
    return {n: [words[r[n]] if r[n] in words else float(r[n]) for r in rows] for n in rows[0]}


SPAN = ("--stop-time", "4", "--step", "0.1")


def test_a_constant_input_gives_the_analytic_solution(lag2: Path, tmp_path: Path) -> None:
    """x' = (u - x) / T from 1: x = u + (1 - u) exp(-t / T)."""
    out = tmp_path / "deep" / "out.csv"
    starts = ("--start-value", "u=3", "--start-value", "time_constant=0.5")
    outcome = run(lag2, *SPAN, *starts, "--record", "x", "--output", out)
    assert outcome.exit_code is Exit.DONE, outcome.text
    found = table(out)
    assert list(found) == ["time", "x"]
    assert found["time"] == pytest.approx([k / 10 for k in range(41)])
    assert found["x"] == pytest.approx([3 - 2 * math.exp(-k / 5) for k in range(41)], rel=1e-9)
    assert outcome.data["rows"] == 41
    assert outcome.data["last"]["x"] == found["x"][-1]
    assert "41 rows, 0 to 4 s in 40 steps of 0.1 s" in outcome.text


def test_names_with_brackets_are_names(lag2: Path, tmp_path: Path) -> None:
    """FMI 2.0 has no arrays, so tools call their elements like that."""
    fmu = changed(
        lag2, tmp_path, (b'name="x"', b'name="x[1]"'), (b'name="stop"', b'name="stop[1]"')
    )
    out = tmp_path / "out.csv"
    for words in ((), ("--record", "x[1]"), ("--record", "x*"), ("--record", "stop[1]")):
        outcome = run(fmu, *SPAN, *words, "--output", out)
        assert outcome.exit_code is Exit.DONE, outcome.text
        wanted = words[1].replace("*", "[1]") if words else "x[1]"
        assert wanted in table(out)
    outcome = execute("compare", fmu, fmu)
    assert outcome.exit_code is Exit.DONE, outcome.text
    last = next(line for line in run(fmu, *SPAN).text.splitlines() if line.startswith("x[1]"))
    assert last.endswith("V")


def test_an_array_of_a_chosen_length_stands_in_the_table(
    fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    """`spare` has `n_spare` elements, 0, 1, ...; the arrays along `row` follow an input."""
    out = tmp_path / "out.csv"
    outcome = run(
        fmu("matrix"), *SPAN, "--start-value", "n_spare=5", "--record", "sp*", "--output", out
    )
    assert outcome.exit_code is Exit.DONE, outcome.text
    assert list(table(out)) == ["time", *(f"spare[{k}]" for k in range(5))]
    assert [set(column) for name, column in table(out).items() if name != "time"] == [
        {float(k)} for k in range(5)
    ]
    wrong = run(fmu("matrix"), *SPAN, "--record", "row.scaled")
    assert "`row.scaled` is float64[row, 4], and a table has numbers, as many in each" in wrong.text


def test_texts_are_named_as_such(lag2: Path) -> None:
    wrong = run(lag2, *SPAN, "--record", "label")
    assert "--record label: `label` is text, and a table has numbers" in wrong.text


def test_an_input_that_no_table_can_drive_starts_as_it_is_said(
    lag2: Path, words3: Path, tmp_path: Path
) -> None:
    """An Enumeration by the name of an item; what is no item is refused. So are texts."""
    was = b'name="method" valueReference="3" causality="parameter" variability="fixed"'
    becomes = was.replace(b"parameter", b"input").replace(b"fixed", b"discrete")
    path = changed(lag2, tmp_path, (was, becomes))
    outcome = run(path, *SPAN, "--start-value", "method=Forward Euler", "--record", "method_used")
    assert outcome.exit_code is Exit.DONE, outcome.text
    assert outcome.data["last"]["method_used"] == 5
    wrong = run(path, *SPAN, "--start-value", "method=4")
    assert "--start-value method: cannot be 4; there are: Forward Euler, exact" in wrong.text
    texts = FmuComponentType(words3)
    assert texts.numbers == ()
    assert {"start.word", "start.pair"} <= set(texts.parameters)


def test_a_parameter_that_cannot_be_set_is_named(words3: Path, tmp_path: Path) -> None:
    was = b'<Binary name="bits" valueReference="3" causality="input"'
    becomes = was.replace(b'"input"', b'"parameter" variability="fixed"')
    kind = FmuComponentType(changed(words3, tmp_path, (was, becomes)))
    assert "(without `bits` (Binary): not supported as parameters)" in kind.description


def test_what_is_wrong_with_a_description_is_said_in_words(lag2: Path, tmp_path: Path) -> None:
    """An index beyond the variables (FMI 2.0.4, section 2.2.8) is an IndexError of the reader."""
    path = changed(lag2, tmp_path, (b'<Unknown index="9"/>', b'<Unknown index="99"/>'))
    outcome = run(path, *SPAN)
    hint = "`nlosim fmu validate` says which rules are broken"
    assert outcome.text.endswith(f"lag2.fmu: modelDescription.xml is invalid; {hint}")
    assert run(tmp_path, *SPAN).text.endswith("is a folder, no file")


def test_arrays_without_a_row_are_tables_without_a_row(tmp_path: Path) -> None:
    """As of a run that failed before its first communication point."""
    empty = Results(np.empty(0), {"y": np.empty((0, 2, 2))}, {"y": "m"})
    write_results(empty, tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text().split() == ["time,y[0],y[1],y[2],y[3]"]
    draw(empty, tmp_path / "out.svg")
    one = Results(np.zeros(1), {"y": np.ones((1, 2))}, {"y": "m"})
    assert [line.split() for line in summary(one).splitlines()[1:]] == [
        ["y[0]", "1", "1", "1", "1", "m"],
        ["y[1]", "1", "1", "1", "1", "m"],
    ]


def test_a_step_is_a_fraction_of_a_second(lag2: Path, tmp_path: Path) -> None:
    """60 steps of 1/60 s end at 1 s."""
    out = tmp_path / "out.csv"
    outcome = run(lag2, "--stop-time", "1", "--step", "1/60", "--output", out)
    assert "61 rows, 0 to 1 s in 60 steps of 1/60 s" in outcome.text
    assert outcome.data["step_s"] == 1 / 60
    found = table(out)["time"]
    assert found == pytest.approx([k / 60 for k in range(61)], abs=0.5e-9)
    assert found[-1] == 1.0
    wrong = run(lag2, "--stop-time", "1", "--step", "1/7.5")
    assert "--step '1/7.5': write seconds, such as `0.01` or `1/60`" in wrong.text
    wrong = run(lag2, "--stop-time", "1", "--step", "3/7")
    assert (
        "--step 0.428571: the interval of 1 s is not a whole number of steps of 3/7 s" in wrong.text
    )


def test_it_is_what_fmpy_simulates(lag2: Path, tmp_path: Path) -> None:
    """Continuous inputs interpolated, discrete ones held, two rows of one time a step."""
    inputs = tmp_path / "in.csv"
    inputs.write_text("time,u,count_in\n0,0,1\n1,2,1\n1,4,5\n2.5,1,6\n4,1,9\n")
    assert run(lag2, *SPAN, "--input", inputs, "--output", tmp_path / "o.csv").exit_code == 0
    ours = table(tmp_path / "o.csv")
    kinds = [("time", "<f8"), ("u", "<f8"), ("count_in", "<i4")]
    signals = np.array([(0, 0, 1), (1, 2, 1), (1, 4, 5), (2.5, 1, 6), (4, 1, 9)], dtype=kinds)
    theirs: Any = fmpy.simulate_fmu(
        str(lag2), stop_time=4.0, step_size=0.1, output_interval=0.1, input=signals, output=["x"]
    )
    assert ours["x"] == pytest.approx(list(theirs["x"]), abs=1e-12)


@pytest.mark.skipif(not has_parquet(), reason="pyarrow is not installed")
def test_parquet_has_the_values_of_csv(lag2: Path, tmp_path: Path) -> None:
    for suffix in ("csv", "parquet"):
        run(lag2, *SPAN, "--start-value", "u=3", "--output", tmp_path / f"o.{suffix}")
    one, other = (read_results(tmp_path / f"o.{suffix}") for suffix in ("csv", "parquet"))
    assert one.columns["x"].tolist() == other.columns["x"].tolist()
    assert one.times.tolist() == other.times.tolist()


def test_plots_are_drawn_where_they_are_asked_for(lag2: Path, tmp_path: Path) -> None:
    for suffix, head in ((".svg", b"<?xml"), (".png", b"\x89PNG")):
        picture = tmp_path / f"a{suffix}"
        assert run(lag2, *SPAN, "--record", "x", "--plot", picture).exit_code == 0
        assert picture.read_bytes().startswith(head)
    starts = ("--start-value", "u=3", "--record", "x")
    outcome = run(lag2, *SPAN, *starts, "--plot", "terminal")
    assert run(lag2, *SPAN, *starts, "--plot", "-").text == outcome.text
    name, line, axis = outcome.text.splitlines()[:3]
    blocks = line.split()[0]
    assert name == "x"
    assert len(blocks) == 60
    assert (blocks[0], blocks[-1]) == ("▁", "█")
    assert list(blocks) == sorted(blocks)
    assert axis.split() == ["0", "s", "4", "s"]


def test_the_summary_has_last_least_greatest_and_mean(lag2: Path, tmp_path: Path) -> None:
    inputs = tmp_path / "in.csv"
    inputs.write_text("time,count_in\n0,2\n1,6\n3,4\n")
    text = run(lag2, *SPAN, "--input", inputs, "--record", "count_out").text.splitlines()
    assert text[0].split() == ["last", "min", "max", "mean", "unit"]
    assert text[1].split()[0] == "count_out"
    last, low, high, _, unit = text[1].split()[1:]
    assert [float(last), float(low), float(high), unit] == [float(v) for v in (last, low, high)] + [
        "1"
    ]
    assert float(low) < float(last) < float(high)


def test_a_mean_is_over_time_and_a_line_from_least_to_greatest() -> None:
    """Of 2 t^2 over uneven times, by the trapezoidal rule; and of a step from 3 to 3.4."""
    times = np.array([0.0, 1.0, 3.0, 4.0])
    parabola, jump = 2.0 * times**2, np.array([3.0, 3.0, 3.4, 3.4])
    results = Results(times, {"a": parabola, "b": jump}, {"a": "m"})
    _, one, other = summary(results).splitlines()
    assert one.split() == ["a", "32", "0", "32", f"{(1.0 + 20.0 + 25.0) / 4.0:.6g}", "m"]
    assert other.split() == ["b", "3.4", "3", "3.4", f"{(3.0 + 6.4 + 3.4) / 4.0:.6g}"]
    lines = lines_of_text(results).splitlines()
    assert lines[2] == "b"
    blocks, least, _, greatest = lines[3].split()
    assert (least, greatest) == ("3", "3.4")
    assert blocks == "▁" * 45 + "█" * 15


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--start-value", "u"), "--start-value u: write NAME=VALUE"),
        (("--start-value", "v=1"), "--start-value v: there is no such parameter or input"),
        (("--start-value", "u=text"), "--start-value u: 'text' is no number"),
        (("--start-value", "time_constant=-1"), "--start-value time_constant: "),
        (("--record", "z*"), "--record z*: no variable matches"),
        (
            ("--step", "0.3"),
            "--step 0.3: the interval of 1 s is not a whole number of steps of 300 ms: 100 ms",
        ),
        (("--step", "x"), "--step 'x': write seconds"),
        (("--stop-time", "-1"), "the run stops at -1 s, not after its start at 0 s"),
        (("--output", "a.txt"), "--output a.txt: write a name that ends in .csv or .parquet"),
        (("--plot", "a.pdf"), "--plot a.pdf: write `terminal`, or a name in .svg or .png"),
        (("--input", "none.csv"), "none.csv: cannot be read"),
    ],
)
def test_a_wrong_word_is_said(lag2: Path, words: tuple[str, ...], said: str) -> None:
    outcome = run(lag2, *words)
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert said in outcome.text


def test_every_problem_of_a_table_is_told_with_its_line(lag2: Path, tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    path.write_text("time,u\n0,1\n1\n2,x\n")
    text = run(lag2, "--input", path).text
    assert f"{path}:3: 1 fields, the header has 2" in text
    assert f"{path}:4: `u`: `x` is no number" in text
    path.write_text("time,v,count_in\n0,1,1\n1,1,1.5\n")
    text = run(lag2, "--input", path).text
    assert f"{path}:1: there is no input `v`; there are: count_in, flag_in, u" in text
    assert f"{path}:3: `count_in` is int32, not 1.5" in text
    path.write_text("time,u\n0,1\n1,\n")
    assert f"{path}:3: `u`: there is no number" in run(lag2, "--input", path).text
    path.write_text("u\n0\n")
    assert f"{path}:1: there is no column `time`" in run(lag2, "--input", path).text
    path.write_text("time,u\n0,0\n2,0\n1,0\n")
    assert f"{path}:4: the time 1 s comes after 2 s" in run(lag2, "--input", path).text


def test_what_fails_leaves_the_results_until_then(lag2: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    outcome = run(lag2, *SPAN, "--start-value", "fail_at=2", "--output", out)
    assert outcome.exit_code is Exit.COMPONENT_FAILED
    assert "component `fmu` at t = " in outcome.text
    assert outcome.text.endswith(f"results until then: {out}")
    times = table(out)["time"]
    assert 1.5 < times[-1] < 2.05
    assert len(times) == round(times[-1] * 10) + 1


@pytest.mark.parametrize("words", [[], ["--logging"]])
def test_an_fmu_is_heard_if_it_is_asked_to_speak(
    lag2: Path, words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(lag2, "--stop-time", "1", "--step", "0.1", *words).exit_code == 0
    assert capfd.readouterr().err == ("logAll: it begins\n" if words else "")


def test_arrays_are_one_field_in_and_columns_out(
    fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    path, out = tmp_path / "in.csv", tmp_path / "out.csv"
    path.write_text("time,float64.in\n0,1 2 3\n1,4 5 6\n")
    words = ("--stop-time", "2", "--step", "1", "--input", path, "--record", "float64.out")
    assert run(fmu("mirror"), *words, "--output", out).exit_code == 0
    found = table(out)
    assert list(found) == ["time", *(f"float64.out[{k}]" for k in range(3))]
    # half of what was there when the step began, and the time at its end
    expected = [[v / 2 + t for v in row] for t, row in ((1, (1, 2, 3)), (2, (4, 5, 6)))]
    assert [[found[f"float64.out[{k}]"][i] for k in range(3)] for i in (1, 2)] == expected
    path.write_text("time,float64.in\n0,1 2\n")
    assert f"{path}: `float64.in` has 3 elements, not 2" in run(fmu("mirror"), *words).text


MOST, MOST_UNSIGNED = 2**63 - 1, 2**64 - 1


@pytest.mark.parametrize(
    ("kind", "heading", "values"),
    [
        ("int64", "int64.out", (-MOST - 1, MOST - 2000)),
        ("int64", "int64.out", (MOST - 1001, 0)),
        ("uint64", "uint64.out[1]", (1, MOST_UNSIGNED - 2000)),
    ],
)
def test_whole_numbers_arrive_to_the_last_digit(
    fmu: Callable[[str], Path], tmp_path: Path, kind: str, heading: str, values: tuple[int, int]
) -> None:
    """Float64 has all up to 2^53; the Reference FMUs come with inputs of 2^64 - 1.

    What comes out is what went in, and 1000 more for every second.
    """
    path, out = tmp_path / "in.csv", tmp_path / "out.csv"
    around = ("", "") if kind == "int64" else ("7 ", " 8")
    rows = [f"{t},{around[0]}{value}{around[1]}" for t, value in enumerate(values)]
    path.write_text("\n".join([f"time,{kind}.in", *rows]))
    words = ("--stop-time", "2", "--step", "1", "--input", path, "--record", f"{kind}.out")
    outcome = run(fmu("mirror"), *words, "--output", out)
    assert outcome.exit_code == 0, outcome.text
    with out.open(newline="") as file:
        found = [int(row[heading]) for row in csv.DictReader(file)]
    assert found[1:] == [values[0] + 1000, values[1] + 2000]


@pytest.mark.parametrize(
    ("kind", "row", "said"),
    [
        ("int64", f"{MOST + 1}", f"int64, not {MOST + 1}"),
        ("int64", "9.3e18", "int64, not 9.3e+18"),
        ("uint64", "1 -1 2", "uint64, not -1"),
        ("uint64", f"1 {MOST_UNSIGNED + 1} 2", "uint64, not 1.84467e+19"),
        ("int8", "1 2 -129", "int8, not -129"),
    ],
)
def test_a_whole_number_that_the_type_has_not_is_told(
    fmu: Callable[[str], Path], tmp_path: Path, kind: str, row: str, said: str
) -> None:
    path = tmp_path / "in.csv"
    path.write_text(f"time,{kind}.in\n0,{'1 ' * len(row.split())}\n1,{row}\n")
    words = ("--stop-time", "2", "--step", "1", "--input", path)
    assert f"{path}:3: `{kind}.in` is {said}" in run(fmu("mirror"), *words).text


def test_results_are_compared_at_common_times(tmp_path: Path) -> None:
    """The second is interpolated: 2 t at 0.5 s between 0 and 1 s is 1."""
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("time,y,z,only\n0,0,1,1\n0.5,1.25,1,1\n1,2,1,1\n9,0,0,0\n")
    other.write_text("time,y,z\n0,0,1\n1,2,1\n")
    outcome = execute("compare", one, other, "--relative", "0.1")
    assert outcome.exit_code is Exit.NOT_PASSED
    y, z = outcome.data["variables"]
    assert (y["name"], y["largest"], y["at_s"], y["first_s"]) == ("y", 0.25, 0.5, 0.5)
    assert y["allowed"] == pytest.approx(0.2)
    assert (z["largest"], z["first_s"]) == (0.0, None)
    assert outcome.data["only_first"] == ["only"]
    assert "1 of 2 variables agree" in outcome.text
    assert "only in" in outcome.text
    enough = ("compare", one, other, "--relative", "0.125")
    assert execute(*enough).exit_code is Exit.DONE  # 0.125 of 2 is 0.25
    assert execute("compare", one, other, "--relative", "0.1249").exit_code is Exit.NOT_PASSED
    assert execute("compare", one, other, "--relative", "0", "--absolute", "0.25").exit_code == 0


def test_nan_is_a_difference(tmp_path: Path) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("time,y\n0,0\n1,nan\n")
    other.write_text("time,y\n0,0\n1,1\n")
    assert execute("compare", one, other).exit_code is Exit.NOT_PASSED
    assert execute("compare", one, one).exit_code is Exit.DONE


def test_fmus_are_compared_by_what_they_do(lag2: Path, tmp_path: Path) -> None:
    assert execute("compare", lag2, lag2, "--relative", "0").exit_code is Exit.DONE
    run(lag2, "--start-value", "u=1", "--output", tmp_path / "other.csv")
    outcome = execute("compare", lag2, tmp_path / "other.csv")
    assert outcome.exit_code is Exit.NOT_PASSED
    (x,) = [row for row in outcome.data["variables"] if row["name"] == "x"]
    assert x["at_s"] == 1.0
    assert x["largest"] == pytest.approx(1 - math.exp(-0.5))


def test_nothing_in_common_is_no_agreement(tmp_path: Path) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("time,y\n0,0\n")
    other.write_text("time,z\n0,0\n")
    assert execute("compare", one, other).exit_code is Exit.NOT_PASSED
    other.write_text("time,y\n5,0\n")
    assert execute("compare", one, other).exit_code is Exit.NOT_PASSED


def test_an_fmu_that_asks_for_the_end_has_results_until_then(lag2: Path, tmp_path: Path) -> None:
    """Exit code 0, and the reason."""
    out = tmp_path / "out.csv"
    starts = ("--start-value", "fail_at=0.35", "--start-value", "fail_as=14")
    outcome = run(lag2, *SPAN, *starts, "--output", out)
    assert outcome.exit_code is Exit.DONE, outcome.text
    text = "`fmu` asks for the end (`fmi2Terminated`) at t = 0.4 s"
    assert f"5 rows, 0 to 4 s in 40 steps of 0.1 s\nended early: {text}\n" in outcome.text
    assert outcome.data["ended_early"] == text
    assert table(out)["time"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
