"""`signal`: one number of one recorded signal, exact for values that hold."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.recording.reader import Recording
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.wiring import assemble
from studies.measures import held
from studies.measures.signal import SignalStatistic, Statistic
from tests.studies.measures.numbers import recorded


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return recorded(tmp_path_factory.mktemp("numbers") / "run")


def found(run: Recording, signal: str, statistic: Statistic, **more: Any) -> tuple[Any, Any]:
    numbers = SignalStatistic(signal=signal, statistic=statistic, **more).compute(run)
    assert set(numbers) == {"value", "unit"}
    return numbers["value"], numbers["unit"]


@pytest.mark.parametrize(
    ("statistic", "value", "unit"),
    [
        ("first", 0.0, "m"),
        ("last", 1.0, "m"),
        ("minimum", 0.0, "m"),
        ("maximum", 1.0, "m"),
        ("mean", 0.45, "m"),  # 0, 0.1, ..., 0.9 hold for 0.1 s each
        ("integral", 0.45, "m.s"),
        ("rms", math.sqrt(0.285), "m"),
        ("time-of-minimum", 0.0, "s"),
        ("time-of-maximum", 1.0, "s"),
    ],
)
def test_numbers_of_a_ramp(
    run: Recording, monkeypatch: pytest.MonkeyPatch, statistic: Statistic, value: float, unit: str
) -> None:
    """They are the same in whatever pieces it is read."""
    for block in (1, 3, 1 << 14):
        monkeypatch.setattr(held, "BLOCK", block)
        assert found(run, "plant.ramp", statistic) == (pytest.approx(value, abs=1e-15), unit)


def test_what_does_not_change_has_its_value_for_a_mean(run: Recording) -> None:
    assert found(run, "plant.mass", "mean") == (2.0, "kg")
    assert found(run, "plant.mass", "rms") == (2.0, "kg")
    assert found(run, "plant.mass", "integral") == (0.0, "kg.s")


def test_elements_truths_and_whole_numbers(run: Recording) -> None:
    assert found(run, "plant.force[2]", "minimum") == (-3.0, "N")
    assert found(run, "plant.force[-2]", "last") == (2.0, "N")
    assert found(run, "plant.is_late", "mean") == (pytest.approx(0.3), "1")
    assert found(run, "plant.count", "last") == (10.0, "1")
    assert found(run, "plant.count", "integral") == (pytest.approx(4.5), "s")


def test_a_slower_component_holds_longer(run: Recording) -> None:
    """0, -0.25, -0.5, -0.75 m hold for a quarter of a second each."""
    assert found(run, "sensor.value", "mean") == (pytest.approx(-0.375), "m")
    assert found(run, "sensor.value", "time-of-minimum") == (1.0, "s")


def test_a_part_of_the_time(run: Recording) -> None:
    """From 0.35 s 0.3 m holds for 0.05 s; until 0.55 s 0.5 m holds for 0.05 s."""
    span = {"begin": 0.35, "end": 0.55}
    area = 0.3 * 0.05 + 0.4 * 0.1 + 0.5 * 0.05
    assert found(run, "plant.ramp", "integral", **span) == (pytest.approx(area, rel=1e-12), "m.s")
    assert found(run, "plant.ramp", "mean", **span) == (pytest.approx(area / 0.2), "m")
    assert found(run, "plant.ramp", "time-of-minimum", **span) == (pytest.approx(0.35), "s")
    assert found(run, "plant.ramp", "maximum", **span) == (0.5, "m")
    assert found(run, "plant.ramp", "first", begin=0.5) == (0.5, "m")
    assert found(run, "plant.ramp", "last", begin=2.0) == (None, "m")


@pytest.mark.parametrize(
    ("condition", "first", "duration"),
    [
        ("> 0.3", 0.4, 0.6),
        (">= 30 cm", 0.3, 0.7),
        ("< 0.2", 0.0, 0.2),
        ("<= 0.2 m", 0.0, 0.3),
        ("== 0.5", 0.5, 0.1),
        ("!= 0", 0.1, 0.9),
        ("> 5", None, 0.0),
    ],
)
def test_when_and_how_long(
    run: Recording, condition: str, first: float | None, duration: float
) -> None:
    """A condition without a unit is in that of the signal."""
    expected = first if first is None else pytest.approx(first)
    assert found(run, "plant.ramp", "time-of-first", condition=condition) == (expected, "s")
    lasts = pytest.approx(duration, abs=1e-12)
    assert found(run, "plant.ramp", "duration", condition=condition) == (lasts, "s")


def test_a_truth_is_a_condition(run: Recording) -> None:
    asked = {"condition": "== true"}
    assert found(run, "plant.is_late", "time-of-first", **asked) == (pytest.approx(0.7), "s")


def test_errors_against_a_table(run: Recording, tmp_path: Path) -> None:
    """The ramp against one that is 2 cm higher, in other units, with rows at other times."""
    file = tmp_path / "reference.csv"
    file.write_text("time [ms],x [cm]\n0,2\n400,42\n1000,102\n")
    asked = {"reference": file, "column": "x"}
    assert found(run, "plant.ramp", "rms-error", **asked) == (pytest.approx(0.02), "m")
    assert found(run, "plant.ramp", "maximum-error", **asked) == (pytest.approx(0.02), "m")
    held_apart = np.array(
        [0.02, -0.08, -0.18, -0.28, 0.02, -0.08, -0.18, -0.28, -0.38, -0.48, 0.02]
    )
    asked |= {"interpolation": "hold"}
    rms = math.sqrt(np.mean(held_apart**2))
    assert found(run, "plant.ramp", "rms-error", **asked) == (pytest.approx(rms), "m")
    assert found(run, "plant.ramp", "maximum-error", **asked) == (pytest.approx(0.48), "m")


def test_a_reference_that_is_too_short_is_no_reference(run: Recording, tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time,plant.ramp\n0,0\n0.9,0.9\n")
    with pytest.raises(
        ValueError, match=r"reference.csv:3:1: rows are missing: the last is at 0.9"
    ):
        found(run, "plant.ramp", "rms-error", reference=file)
    assert found(run, "plant.ramp", "rms-error", reference=file, end=0.9)[0] < 1e-15


def test_a_reference_that_is_gone_is_named(run: Recording, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"gone.csv:1:1: cannot be read"):
        found(run, "plant.ramp", "rms-error", reference=tmp_path / "gone.csv")


def test_what_is_no_number_cannot_be_averaged(tmp_path: Path) -> None:
    with pytest.raises(
        ValueError, match=r"`plant.list` is float64\[item\], whose length may change"
    ):
        found(recorded(tmp_path / "run"), "plant.list", "mean")


DURATION = "signal: source.height, statistic: duration, condition:"
SCENARIO = """\
schema: 1
title: A table that is played
time: {stop: 1 s}
components:
  source: {type: table-source, step: 100 ms, parameters: {file: in.csv, interpolation: linear}}
measures:
  top: {type: signal, signal: source.height, statistic: maximum}
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "in.csv").write_text("time [s],height [m],x[2] [m]\n0,0,0\n0.5,3,1\n1,1,1\n")
    path = tmp_path / "play.yaml"
    path.write_text(SCENARIO)
    return path


def test_a_run_tells_value_and_unit(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario), "--out", str(out)]) == 0
    assert "top: value 3, unit m" in capsys.readouterr().out
    assert json.loads((out / "metrics.json").read_text())["measures"] == {
        "top": {"value": 3.0, "unit": "m"}
    }


@pytest.mark.parametrize(
    ("measure", "place", "what"),
    [
        (
            "signal: source.hight",
            "source",
            "`source.hight` is not recorded; did you mean `source.h",
        ),
        ("signal: 'source.height[0]'", "'source", "is float64[]: `[0]` says 1, and it has no axes"),
        ("signal: 'source.x[2][1]'", "'source", "is not recorded; did you mean `source.x[2]`?"),
        (
            "signal: source.height, statistic: top",
            "top}",
            'cannot be "top"; there are: duration, first, ',
        ),
        ("signal: source.height, statistic: duration", "top:", "`duration` needs a `condition`"),
        ("signal: source.height, condition: '> 3'", "cond", "only `time-of-first` and `duration`"),
        (f"{DURATION} '> 3 s'", "'> 3", "expected a length (m), got a time (s)"),
        (f"{DURATION} 'about 3'", "'about", "`about 3` is no condition; write `> 3`, `<= 30 km/h`"),
        ("signal: source.height, column: x", "column", "there is no `reference`"),
        ("signal: source.height, begin: 2 s", "2 s", "is after the end of the run"),
        ("signal: source.height, begin: 2 s, end: 1 s", "1 s", "must be after `begin`"),
        ("signal: source.height, statistic: rms-error", "top:", "`rms-error` needs a `reference`"),
    ],
)
def test_mistakes_are_found_before_the_run(
    scenario: Path, measure: str, place: str, what: str
) -> None:
    line = f"  top: {{type: signal, {measure}}}"
    scenario.write_text(f"{SCENARIO.partition('  top:')[0]}{line}\n")
    with pytest.raises(ScenarioError) as error:
        assembled(scenario)
    (problem,) = error.value.problems
    assert what in problem.what
    assert (problem.where.line, problem.where.column) == (7, line.index(place) + 1)


def assembled(scenario: Path) -> None:
    assemble(load_scenario(scenario)).close()


@pytest.mark.parametrize(
    ("span", "missing"),
    [
        ("begin: 0.2 s, end: 0.8 s", 0),
        ("begin: 0.19 s, end: 0.8 s", 1),
        ("begin: 0.2 s, end: 0.81 s", 1),
        ("end: 0.81 s", 2),
    ],
)
def test_a_reference_is_as_long_as_the_comparison(scenario: Path, span: str, missing: int) -> None:
    (scenario.parent / "ref.csv").write_text("time,source.height\n0.2,0\n0.8,1\n")
    entry = f"statistic: rms-error, reference: ref.csv, {span}"
    scenario.write_text(SCENARIO.replace("statistic: maximum", entry))
    if not missing:
        assembled(scenario)
        return
    with pytest.raises(ScenarioError) as error:
        assembled(scenario)
    assert [": rows are missing: " in str(each) for each in error.value.problems] == [
        True
    ] * missing


@pytest.mark.parametrize(
    ("table", "place", "what"),
    [
        ("time,height\n0,0\n\n0.5,\n1,1\n", (4, 5), "there is no number"),
        (
            "time,height\n0,0\n0.9,1\n",
            (3, 1),
            "the last is at 0.9 s, and the comparison ends at 1 s",
        ),
        (
            "time,height\n0.1,0\n2,1\n",
            (2, 1),
            "the first is at 0.1 s, and the comparison begins at 0",
        ),
        ("time,heigt\n0,0\n1,1\n", (1, 1), "there is no column `height`; did you mean `heigt`?"),
        ("time,height [s]\n0,0\n1,1\n", (1, 1), "`height`: expected a length (m), got a time (s)"),
    ],
)
def test_a_reference_with_mistakes_is_named_with_its_line(
    scenario: Path, table: str, place: tuple[int, int], what: str
) -> None:
    (scenario.parent / "ref.csv").write_text(table)
    entry = "statistic: rms-error, reference: ref.csv, column: height"
    scenario.write_text(SCENARIO.replace("statistic: maximum", entry))
    with pytest.raises(ScenarioError) as error:
        assembled(scenario)
    (problem,) = error.value.problems
    assert problem.where.file.endswith("ref.csv")
    assert (problem.where.line, problem.where.column) == place
    assert what in problem.what
