"""What `nlosim fmu compare` makes of units, texts, run directories and results that end early."""

from pathlib import Path

import pytest

from adapters.fmu_command import add_command
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit, Outcome
from tests.commands import executed
from tests.studies.measures.numbers import recorded


def compare(*words: str | Path) -> Outcome:
    return executed(add_command, "fmu", "compare", *map(str, words))


@pytest.fixture
def one(tmp_path: Path) -> Path:
    path = tmp_path / "one.csv"
    path.write_text("time [s],v [m/s],n\n0,0,0\n0.5,10,1\n1,20,2\n")
    return path


def test_units_in_headings_are_converted(one: Path, tmp_path: Path) -> None:
    """36 km/h are 10 m/s, 500 ms half a second; without a unit a number is what it says."""
    other = tmp_path / "other.csv"
    other.write_text("time [ms],v [km/h],n\n0,0,0\n500,36,1\n1000,72,2\n")
    outcome = compare(one, other)
    assert outcome.exit_code is Exit.DONE
    assert [row["largest"] for row in outcome.data["variables"]] == [0.0, 0.0]
    assert (outcome.data["from_s"], outcome.data["to_s"]) == (0.0, 1.0)
    other.write_text("time,v\n0,0\n0.5,10\n1,20\n")
    assert compare(one, other).exit_code is Exit.DONE
    other.write_text("time,v [s]\n0,0\n")
    outcome = compare(one, other)
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert "`v`: units differ: m/s and s" in outcome.text
    other.write_text("time [m],v\n0,0\n")
    assert f"{other}:1: `time` is in `m`, which is no time" in compare(one, other).text
    other.write_text("time [sec],v\n0,0\n")
    assert f"{other}:1: `time`: `sec` is not a unit" in compare(one, other).text


def test_temperatures_are_shifted(tmp_path: Path) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("time,T [K]\n0,293.15\n")
    other.write_text("time,T [degC]\n0,20\n")
    assert compare(one, other).exit_code is Exit.DONE


def test_the_worst_point_is_told(one: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("time,v,n\n0,0,0\n0.5,11,1\n1,20,2.5\n")
    outcome = compare(one, other, "--relative", "0.01", "--absolute", "0")
    assert outcome.exit_code is Exit.NOT_PASSED
    v, n = outcome.data["variables"]
    assert (v["first"], v["second"], v["at_s"], v["first_s"]) == (10.0, 11.0, 0.5, 0.5)
    assert (n["first"], n["second"], n["at_s"], n["first_s"]) == (2.0, 2.5, 1.0, 1.0)
    assert "v: largest difference 1 at 0.5 s (10 and 11), beyond 0.2 from 0.5 s on" in outcome.text
    # 1 is 5 times as much as 0.2, 0.5 is 20 times as much as 0.025
    assert outcome.text.endswith("0 of 2 variables agree; the worst is n at 1 s")


def test_a_result_that_ends_early_is_named(one: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("time,v,n\n0.5,10,1\n0.75,15,1.5\n")
    outcome = compare(one, other)
    assert outcome.exit_code is Exit.DONE
    assert f"compared from 0.5 s on: {one} begins at 0 s" in outcome.text
    assert f"compared until 0.75 s: {one} ends at 1 s" in outcome.text
    strict = compare(one, other, "--whole")
    assert strict.exit_code is Exit.NOT_PASSED
    assert strict.text.endswith("2 of 2 variables agree; they do not cover the same time")
    assert compare(one, one, "--whole").exit_code is Exit.DONE


def test_times_that_are_rounded_are_the_same(tmp_path: Path) -> None:
    """A jump of 10^9 at 0.3 s is none between 0.3 and 0.30000000000000004 s."""
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    one.write_text("time,n\n0,0\n0.3,1e9\n1,1e9\n")
    other.write_text("time,n\n0,0\n0.1,0\n0.299999,0\n0.30000000000000004,1e9\n1,1e9\n")
    assert compare(one, other, "--relative", "0", "--absolute", "0").exit_code is Exit.DONE


def test_columns_of_text_are_left_out(one: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("time,v,label\n0,0,a\n0.5,10,b\n1,20,c\n")
    outcome = compare(one, other)
    assert outcome.exit_code is Exit.DONE
    assert outcome.data["only_second"] == []
    other.write_text("time,v,label\n0,0,1\n0.5,10,b\n")
    assert f"{other}:3: `label`: `b` is no number" in compare(one, other).text
    other.write_text("time,v\n0,0 1\n0.5,10\n")
    assert f"{other}:3: `v` has rows of 2 and 1" in compare(one, other).text


def test_a_run_is_its_table(tmp_path: Path) -> None:
    """Signals of all components, also of slower ones, which hold."""
    out = tmp_path / "run"
    recorded(out)
    assert main(["report", str(out), "--measures", "signals"]) == 0
    table = out / "measures" / "signals-table.csv"
    outcome = compare(out, table, "--relative", "0", "--whole")
    assert outcome.exit_code is Exit.DONE, outcome.text
    names = {row["name"] for row in outcome.data["variables"]}
    assert {"plant.ramp", "sensor.value", "plant.force[2]", "plant.mass"} <= names
    table.write_text(table.read_text().replace("-0.75", "-0.76"))
    outcome = compare(out, table)
    assert outcome.text.endswith("the worst is sensor.value at 0.75 s")


@pytest.mark.parametrize("value", ["-1", "nan", "inf"])
def test_a_tolerance_is_a_number_of_at_least_0(one: Path, value: str) -> None:
    outcome = compare(one, one, f"--relative={value}", "--absolute", "0")
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert f"--relative {float(value):g}: write a number of at least 0" in outcome.text
