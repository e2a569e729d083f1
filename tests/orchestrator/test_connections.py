"""Connections of elements, with units, gains and offsets; sums, constants, delays and samples."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from orchestrator.cli import main
from orchestrator.errors import ComponentError
from orchestrator.scenario import routes
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Document
from orchestrator.scenario.graph import graph_of
from orchestrator.scenario.schema import ConnectionEntry
from orchestrator.scenario.wiring import assemble
from tests.orchestrator.wired import FIRST_LINE, refused, seen, wired

pytestmark = pytest.mark.usefixtures("sample_units")

POINTS = np.arange(11.0)
"""The communication points of a run of 1 s, in steps of 100 ms."""


def test_elements_are_driven_one_by_one_and_others_keep_their_start(tmp_path: Path) -> None:
    path = wired(tmp_path, "{from: 'a.x[1:3]', to: 'b.u[2:4]'}", "{from: a.n, to: 'b.u[0]'}")
    expected = np.array([[k, -1, 10 * k + 1, 10 * k + 2] for k in POINTS])
    assert np.array_equal(seen(path), expected)


def test_a_gain_and_an_offset_are_those_of_ssp(tmp_path: Path) -> None:
    path = wired(tmp_path, "{from: 'a.x[-1]', to: b.v, gain: 2, offset: 1}")
    assert seen(path, "w").tolist() == [2 * (10 * k + 3) + 1 for k in POINTS]


def test_a_gain_follows_the_conversion_of_units(tmp_path: Path) -> None:
    path = wired(tmp_path, "{from: a.n, to: b.v, gain: 2, offset: 0.5}", a="unit: km", b="unit: m")
    assert seen(path, "w").tolist() == [2000 * k + 0.5 for k in POINTS]


@pytest.mark.parametrize("units", [("km", "m"), ("V", "m")])
def test_units_that_are_not_converted_may_be_any(tmp_path: Path, units: tuple[str, str]) -> None:
    entry = "{from: a.n, to: b.v, convert: false, gain: 3, offset: 0.5}"
    path = wired(tmp_path, entry, a=f"unit: {units[0]}", b=f"unit: {units[1]}")
    assert seen(path, "w").tolist() == [3 * k + 0.5 for k in POINTS]
    scenario = load_scenario(path)
    (written,) = scenario.resolved()["connections"]
    assert written == {"from": "a.n", "to": "b.v", "gain": 3.0, "offset": 0.5, "convert": False}
    (edge,) = graph_of(scenario, assemble(scenario)).edges
    assert "* 3 + 0.5, unit not converted" in str(edge)


def test_whole_numbers_become_floats(tmp_path: Path) -> None:
    path = wired(tmp_path, "{from: a.x, to: b.u}", a="dtype: int32")
    assert seen(path).dtype == np.float64
    assert np.array_equal(seen(path), 10 * POINTS[:, None] + np.arange(4))


@given(
    order=st.permutations(range(4)),
    gains=st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=4),
)
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_permutation_of_elements_is_a_permutation_of_values(
    tmp_path: Path, order: list[int], gains: list[float]
) -> None:
    path = wired(
        tmp_path,
        *(f"{{from: 'a.x[{k}]', to: 'b.u[{n}]', gain: {gains[k]!r}}}" for n, k in enumerate(order)),
    )
    expected = [[(10 * p + k) * gains[k] for k in order] for p in POINTS]
    assert seen(path).tolist() == expected


@pytest.mark.parametrize(
    ("connection", "problem"),
    [
        ("{from: 'a.x[4]', to: b.v}", "elements of the source: `[4]`: axis 0 has the indices 0 to"),
        ("{from: a.n, to: 'b.u[0:2]'}", "shapes differ: () and (2,)"),
        ("{from: a.n, to: 'b.u[7]'}", "elements of the target: `[7]`: axis 0 has the indices 0"),
        ("{from: 'a.x[k]', to: b.v}", "cannot connect `a.x[k]` to `b.v`: `x[k]`: `k` is no index"),
        ("{from: 'a.z[0]', to: b.v}", "`a` has no connector `z`; there are: n, x"),
        ("{from: a.n, to: 'b.z[0]'}", "`b` has no connector `z`; there are: u, v, w, y"),
        ("{from: a.n, to: b.v, gain: .inf}", "gain and offset must be finite"),
        ("{from: a.n, to: b.v, gain: x}", "connections[0].gain: "),
        ("{from: a.n, to: b.v, gian: 2}", "connections[0]: `gian` is not a key here; did you mean"),
        ("{from: a.n, to: b.v, delay: -1 s}", "connections[0].delay: must not be negative"),
        ("{from: a.n, to: b.v, sample: 0 s}", "connections[0].sample: must be longer than 0 s"),
        (
            "{from: a.n, to: b.v, sample: 150 ms}",
            "`sample` must be a multiple of the step size of the target, 100 ms, got 150 ms",
        ),
        ("{to: b.v}", "connections[0]: `from` is missing (an output), or `sum` (of outputs), or"),
        ("{from: a.n, value: 3, to: b.v}", "connections[0].value: there is `from` already"),
        ("{sum: [a.n], gain: 2, to: b.v}", "connections[0].gain: belongs to `from`; write it at"),
        ("{sum: [a.n, c.n], to: b.v}", "connections[0].sum[1].from: there is no component `c`"),
        ("{sum: [], to: b.v}", "connections[0].sum: must not be empty"),
        ("{value: 1, delay: 1 s, to: b.v}", "connections[0].delay: belongs to `from`; a constant"),
        ("{value: 1, to: b.z}", "cannot set `b.z` to 1: `b` has no connector `z`"),
        ("{value: 1, to: b.y}", "cannot set `b.y` to 1: it is an output, not an input"),
        ("{value: [1, 2], to: b.u}", "it has the shape (4,), the value (2,)"),
        ("{value: [[1], 2], to: b.u}", "the lists in it differ in length"),
        ("{value: true, to: b.v}", "cannot set `b.v` to true: expected a number, as it is float64"),
        ("{value: .inf, to: b.v}", "it is out of the range of float64"),
        ("{value: 3 s, to: b.v}", "cannot set `b.v` to 3 s: expected a pure number, got a time"),
    ],
)
def test_what_cannot_be_is_said_at_the_line_of_the_connection(
    tmp_path: Path, connection: str, problem: str
) -> None:
    found = refused(wired(tmp_path, connection))
    assert len(found) == 1
    assert found[0].startswith(f"{FIRST_LINE}: ")
    assert problem in found[0]


def test_brackets_without_quotes_are_explained(tmp_path: Path) -> None:
    (found,) = refused(wired(tmp_path, "{from: a.x[2], to: b.v}"))
    assert found.startswith(f"{FIRST_LINE}: `[` begins a list here; write the text in quotes, such")


def test_problems_of_all_connections_are_said_at_once(tmp_path: Path) -> None:
    path = wired(
        tmp_path,
        "{from: 'a.x[9]', to: b.v}",
        "{from: 'a.x[0:2]', to: 'b.u[0:2]'}",
        "{from: 'a.x[2:4]', to: 'b.u[1:3]'}",
        "{value: 3, to: 'b.u[0]'}",
        b="unit: m",
        a="unit: m",
    )
    assert [each.split(":")[0] for each in refused(path)] == [
        str(FIRST_LINE + k) for k in (0, 1, 2)
    ]
    assert "`a.x[0:2]`" in "".join(refused(path))
    assert any("drives [1] already" in each for each in refused(path))


def test_units_of_another_quantity_stay_an_error(tmp_path: Path) -> None:
    (found,) = refused(wired(tmp_path, "{from: a.n, to: b.v}", a="unit: m", b="unit: s"))
    assert found.endswith(
        "cannot connect `a.n` to `b.v`: units differ: m and s; "
        "`convert: false` would take the number as it is"
    )


@pytest.mark.parametrize(
    ("a", "b", "problem"),
    [
        ("dtype: float64", "dtype: float32", "types differ: float64[4] and float32[4]"),
        ("dtype: int64", "dtype: float64", "types differ: int64[4] and float64[4]"),
        ("dtype: uint8", "dtype: int8", "types differ: uint8[4] and int8[4]"),
        (
            "dtype: int32, unit: km",
            "dtype: int64, unit: m",
            "units differ: km and m (* 1000, which takes a floating-point input, not int64)",
        ),
    ],
)
def test_nothing_is_lost_on_the_way(tmp_path: Path, a: str, b: str, problem: str) -> None:
    (found,) = refused(wired(tmp_path, "{from: a.x, to: b.u}", a=a, b=b))
    assert problem in found


def test_a_number_that_becomes_too_large_ends_the_run_with_the_name_of_the_input(
    tmp_path: Path,
) -> None:
    path = wired(tmp_path, "{from: a.n, to: b.v, gain: 1.7e+308}")
    with pytest.raises(ComponentError, match=r"component `b` at t = 0.1 s: what .* input `v`"):
        seen(path, "w")


def test_a_sum_adds_outputs_each_with_its_gain(tmp_path: Path) -> None:
    path = wired(tmp_path, "{sum: [a.n, {from: 'a.x[3]', gain: -0.5, offset: 1}, a.n], to: b.v}")
    assert seen(path, "w").tolist() == [2 * k - 0.5 * (10 * k + 3) + 1 for k in POINTS]


def test_a_constant_is_there_from_the_start_in_the_unit_of_the_input(tmp_path: Path) -> None:
    path = wired(
        tmp_path,
        "{value: 36 km/h, to: 'b.u[1:3]'}",
        "{value: [3, 4], to: 'b.u[::3]'}",
        b="unit: m/s",
    )
    assert seen(path).tolist() == [[3, 10, 10, 4]] * 11


@pytest.mark.parametrize(("algorithm", "lag"), [("gauss-seidel", 0), ("jacobi", 1)])
@pytest.mark.parametrize("delay", [100, 300, 250, 1])
def test_a_delay_holds_the_last_value_that_is_old_enough(
    tmp_path: Path, algorithm: str, lag: int, delay: int
) -> None:
    path = wired(tmp_path, f"{{from: a.n, to: b.v, delay: {delay} ms}}", algorithm=algorithm)
    reads = [max(100 * k - 100 * lag, 0) - delay for k in range(11)]
    assert seen(path, "w").tolist() == [t // 100 if t >= 0 else -1 for t in reads]


@pytest.mark.parametrize("steps", [("20 ms", "100 ms"), ("100 ms", "20 ms")])
def test_a_delay_is_exact_between_different_steps(tmp_path: Path, steps: tuple[str, str]) -> None:
    path = wired(tmp_path, "{from: a.n, to: b.v, delay: 30 ms}", steps=steps)
    h, reader = (int(each.split()[0]) for each in steps)
    expected = [(t - 30) // h if t >= 30 else -1 for t in range(0, 1001, reader)]
    assert seen(path, "w").tolist() == expected


def test_a_delay_breaks_an_algebraic_loop(tmp_path: Path) -> None:
    loop = "{sum: [{from: b.w, delay: 100 ms}, 'a.x[1]'], to: b.v}"
    path = wired(tmp_path, loop)
    expected, before = [-1.0], -1.0
    for k in range(1, 11):
        before += 10 * k + 1
        expected.append(before)
    assert seen(path, "w").tolist() == expected
    assert "algebraic loop" in refused(wired(tmp_path, loop.replace(", delay: 100 ms", "")))[0]


@pytest.mark.parametrize(("algorithm", "lag"), [("gauss-seidel", 0), ("jacobi", 1)])
def test_a_sample_is_held_until_the_next_one(tmp_path: Path, algorithm: str, lag: int) -> None:
    path = wired(tmp_path, "{from: a.n, to: b.v, sample: 300 ms}", algorithm=algorithm)
    assert seen(path, "w").tolist() == [max(k - lag, 0) // 3 * 3 for k in range(11)]


def test_what_was_not_there_at_the_start_is_sampled_as_soon_as_it_is(tmp_path: Path) -> None:
    path = wired(
        tmp_path,
        "{from: b.w, to: b.v, offset: 1, sample: 300 ms}",
        algorithm="gauss-seidel, order: [a, b]",
    )
    assert seen(path, "w").tolist() == [-1, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3]


def test_steps_that_are_repeated_sample_again(tmp_path: Path) -> None:
    """The loop `w = w / 2 + 1` has the solution 2 at every point at which it is sampled."""
    path = wired(
        tmp_path,
        "{from: b.w, to: b.v, gain: 0.5, offset: 1, sample: 100 ms}",
        algorithm="fixed-point",
    )
    assert seen(path, "w")[1:] == pytest.approx([2.0] * 10, abs=1e-5)


def test_whole_numbers_are_not_added(tmp_path: Path) -> None:
    path = wired(tmp_path, "{sum: [a.x, a.x], to: b.u}", a="dtype: int32", b="dtype: int32")
    (found,) = refused(path)
    assert "a gain, offset or sum takes a floating-point input, not int32" in found


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "fixed-point"])
def test_runs_over_the_loopback_transport_have_the_same_bytes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], algorithm: str
) -> None:
    path = wired(
        tmp_path,
        "{from: 'a.x[::-1]', to: b.u, gain: 0.1, delay: 120 ms, sample: 200 ms}",
        "{sum: ['a.x[0]', {from: a.n, gain: 0.3}], to: b.v}",
        a="unit: km/h",
        b="unit: m/s",
        algorithm=algorithm,
    )
    path.write_text(path.read_text().replace("parameters:", "process: on-request, parameters:"))
    found: list[str] = []
    for options in ([], ["--transport", "loopback"]):
        out = tmp_path / f"run{len(found)}"
        assert main(["run", str(path), "--out", str(out), "--json", "--quiet", *options]) == 0
        found.append(json.loads(capsys.readouterr().out)["fingerprint"])
    assert found[0] == found[1]
    again = tmp_path / "again.yaml"
    again.write_text(json.dumps(json.loads((out / "manifest.json").read_text())["scenario"]))
    assert main(["run", str(again), "--out", str(tmp_path / "c"), "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["fingerprint"] == found[0]


def test_the_graph_shows_what_happens_on_the_way_and_how_old_values_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = wired(
        tmp_path,
        "{from: 'a.x[0:2]', to: 'b.u[0:2]', gain: 2}",
        "{from: 'a.x[2]', to: 'b.u[2]', delay: 250 ms}",
        "{from: a.n, to: b.v, sample: 300 ms}",
        "{value: 10, to: 'b.u[3]'}",
        a="unit: km/h",
        b="unit: m/s",
    )
    assert main(["graph", str(path)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert lines[
        lines.index("connections, with the age of the values when a step of the target ends:") :
    ][1:7] == [
        "a -> b 0 x[0:2] -> u[0:2] (* 5 / 18 * 2)",
        "a -> b 0 to 200 ms n -> v (* 5 / 18, sampled every 300 ms)",
        "a -> b 300 ms x[2] -> u[2] (* 5 / 18, 250 ms later)",
        "",
        "constants:",
        "b.u[3] 10",
    ]


@given(
    source=st.integers(1, 6), target=st.integers(1, 6), delay=st.integers(1, 20),
    algorithm=st.sampled_from(["gauss-seidel", "jacobi"]),
)  # fmt: skip
@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_the_ages_that_the_graph_shows_are_those_of_the_run(
    tmp_path: Path, source: int, target: int, delay: int, algorithm: str
) -> None:
    """In units of 10 ms, over a time in which every phase occurs."""
    path = wired(
        tmp_path,
        f"{{from: a.n, to: b.v, delay: {10 * delay} ms}}",
        steps=(f"{10 * source} ms", f"{10 * target} ms"),
        algorithm=algorithm,
    )
    path.write_text(path.read_text().replace("stop: 1 s", f"stop: {600 * 2} ms"))
    scenario = load_scenario(path)
    assembly = assemble(scenario)
    (edge,) = graph_of(scenario, assembly).edges
    values = seen(path, "w")
    ages = [target * k - source * n for k, n in enumerate(values) if n >= 0 and k > 0]
    assert min(ages) * 10_000_000 == edge.youngest
    assert max(ages) * 10_000_000 == edge.oldest


def test_what_the_manual_shows_can_be_read() -> None:
    page = Path(__file__).parents[2] / "docs" / "connections.md"
    (block,) = re.findall(r"```yaml\n(.*?)```", page.read_text(), re.DOTALL)
    entries = Document.parse(block, "connections.md").data["connections"]
    read = [ConnectionEntry.model_validate(entry) for entry in entries]
    assert [list(routes.problems(entry)) for entry in entries] == [[]] * 7
    connections, constants = routes.read(read)
    assert (len(connections), len(constants)) == (7, 1)
