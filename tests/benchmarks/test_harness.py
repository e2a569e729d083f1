import pytest
from hypothesis import given, strategies as st

from benchmarks.benchmark import PeerFailedError, Row
from benchmarks.harness import DefectError, NoSuchCaseError, measure
from benchmarks.spread import Spread
from benchmarks.table import markdown, table
from tests.benchmarks.fakes import CountingBenchmark, interrupt_at

positive = st.floats(1e-6, 1e6)


def row(**changes: object) -> Row:
    values: dict[str, object] = {"case": "a", "ours": 2.0, "low": 1.0, "high": 3.0, "unit": "s"}
    return Row(**(values | changes))  # type: ignore[arg-type]


@pytest.mark.slow
def test_repetitions_take_turns() -> None:
    benchmark = CountingBenchmark(("one", "two", "three"))
    result = measure(benchmark, repeat=2)
    assert benchmark.journal == ["one", "two", "three", "one", "two", "three"]
    assert result.is_complete
    assert result.repetitions == 2
    assert [(r.case, r.ours, r.low, r.high) for r in result.rows] == [
        ("one", 1.5, 1, 2),
        ("two", 1.5, 1, 2),
        ("three", 1.5, 1, 2),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "measured", "repetitions"),
    [(0, {}, 0), (1, {"one": 1}, 0), (3, {"one": 2, "two": 1}, 1)],
)
def test_ctrl_c_keeps_what_was_measured(
    place: int, measured: dict[str, int], repetitions: int
) -> None:
    result = measure(CountingBenchmark(before=interrupt_at(place)), repeat=2)
    assert {r.case: r.details["runs"] for r in result.rows} == measured
    assert result.repetitions == repetitions
    assert not result.is_complete


@pytest.mark.slow
@pytest.mark.parametrize("place", [1, 3])
def test_a_peer_that_fails_is_left_out_and_the_others_are_measured(place: int) -> None:
    calls: list[int] = []

    def fail(call: int) -> None:
        calls.append(call)
        if len(calls) == place + 1:
            raise PeerFailedError("a sloth failed: it sleeps")

    names = ("one", "two") if place == 1 else ("one", "two", "three")
    result = measure(CountingBenchmark(names, before=fail), repeat=3)
    lost = "two" if place == 1 else "one"
    assert result.left_out == {lost: "a sloth failed: it sleeps"}
    left = [name for name in names if name != lost]
    assert {r.case: r.details["runs"] for r in result.rows} == dict.fromkeys(left, 3)
    assert result.repetitions == 3
    assert result.is_complete


@pytest.mark.parametrize("kind", [KeyError, SystemExit])
def test_a_broken_case_is_the_fault_of_its_benchmark(kind: type[BaseException]) -> None:
    """And no internal error: it says which, and the line."""

    def fail(call: int) -> None:
        raise kind(call)

    with pytest.raises(DefectError) as caught:
        measure(CountingBenchmark(("one",), before=fail), repeat=1, label="sloth")
    first, second = str(caught.value).splitlines()
    assert first == f"benchmark `sloth`, case `one`: {kind.__name__}: 0"
    assert second.startswith(f"raised at {__file__}:")


def test_a_pattern_chooses_cases() -> None:
    benchmark = CountingBenchmark(("grid/1", "grid/2", "line/1"))
    measure(benchmark, repeat=1, pattern="grid/*")
    assert benchmark.journal == ["grid/1", "grid/2"]
    with pytest.raises(NoSuchCaseError, match=r"matches `grid/3`; did you mean `grid/\d`\?"):
        measure(benchmark, repeat=1, pattern="grid/3")


def test_nothing_is_drawn_without_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    measure(CountingBenchmark(), repeat=1)
    assert capsys.readouterr() == ("", "")


@given(st.lists(positive, min_size=1))
def test_the_median_lies_between_the_extremes(numbers: list[float]) -> None:
    spread = Spread.of(iter(numbers))
    assert spread.low == min(numbers) <= spread.median <= max(numbers) == spread.high
    below = sum(x < spread.median for x in numbers)
    above = sum(x > spread.median for x in numbers)
    assert max(below, above) <= len(numbers) / 2


@given(ours=positive, peer=positive, is_higher_better=st.booleans())
def test_a_ratio_above_one_means_better(
    *, ours: float, peer: float, is_higher_better: bool
) -> None:
    compared = row(ours=ours, peer=peer, peer_name="them", is_higher_better=is_higher_better)
    assert compared.ratio is not None
    is_better = ours > peer if is_higher_better else ours < peer
    assert (compared.ratio > 1) == is_better or ours == pytest.approx(peer)
    assert Row.from_json(compared.as_json()) == compared


def test_a_row_without_a_peer_has_no_ratio() -> None:
    assert row().ratio is None
    assert Row.from_json(row().as_json()) == row()


def test_tables_have_one_line_per_row_and_a_column_per_detail() -> None:
    rows = [
        row(details={"cpu_s": 0.25}),
        row(case="b", ours=1234.5, peer=12.0, peer_name="them", details={"packets": 1e6}),
    ]
    head, *lines = table(rows)
    assert head.split() == ["case", "ours", "(low", "..", "high)", "unit", "peer", "ratio",
                            "cpu_s", "packets"]  # fmt: skip
    assert lines[0].split() == ["a", "2", "(1", "..", "3)", "s", "0.25"]
    assert lines[1].split() == [
        "b",
        "1234",
        "(1",
        "..",
        "3)",
        "s",
        "12",
        "(them)",
        "103",
        "1000000",
    ]
    assert len({len(line) for line in (head, *lines)}) == 1
    assert [line.count("|") for line in markdown(rows)] == [9, 9, 9, 9]
    assert table([]) == ["  nothing was measured"]
