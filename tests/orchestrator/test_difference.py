"""The first sample that differs in two recordings, for signals of all kinds."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording.difference import Difference, differences
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from tests.orchestrator.cars import CARS, SAMPLES
from tests.recordings import output, record

STEP = 100_000_000


def first(then: Recording, now: Recording) -> Difference:
    found = differences(then, now)
    assert len(found) == 1
    return found[0]


def test_equal_recordings_differ_nowhere(tmp_path: Path) -> None:
    then, now = (record(tmp_path / name, CARS, SAMPLES) for name in "ab")
    assert differences(then, now) == []


@pytest.mark.parametrize(
    ("signal", "change", "element", "values"),
    [
        ("car.id", lambda v: np.add(v, [0, 1]), (1,), ("25", "26")),
        ("car.place", lambda v: v - [[0, 0], [0, 1]], (1, 1), ("503.0", "502.0")),
        ("car.far", np.logical_not, (0,), ("True", "False")),
        ("speed", lambda v: -v, (), ("5.0", "-5.0")),
        ("gains", lambda v: v * [1, 1, 2], (2,), ("5.5", "11.0")),
        ("field", lambda v: v + np.eye(5, 4), (0, 0), ("5.0", "6.0")),
        ("pair", lambda v: np.add(v, [[0, 0], [1, 0]]), (1, 0), ("2.0", "3.0")),
        ("word", lambda v: v.replace(b"5", b"6"), (6,), ("0x35", "0x36")),
        ("blob", lambda v: v[1:], (), ("5 bytes", "4 bytes")),
    ],
)
def test_the_first_sample_and_element_are_found(
    signal: str,
    change: Callable[[Any], Any],
    element: tuple[int, ...],
    values: tuple[str, str],
    tmp_path: Path,
) -> None:
    changed = [dict(each) for each in SAMPLES]
    for k in (5, 6):  # the last one has no cars
        value = changed[k][signal]
        if len(changed[k]["car.id"]):
            made = change(value)
            changed[k][signal] = made if isinstance(value, bytes) else np.asarray(made, value.dtype)
    then, now = record(tmp_path / "a", CARS, SAMPLES), record(tmp_path / "b", CARS, changed)
    assert first(then, now) == Difference(
        signal=f"source.{signal}", time=5 * STEP, element=element, then=values[0], now=values[1]
    )


@pytest.mark.parametrize("k", [0, 255, 256, 300, 599])
def test_it_is_found_wherever_it_is_in_a_long_series(k: int, tmp_path: Path) -> None:
    samples = [{"y": np.array(float(n))} for n in range(600)]
    then = record(tmp_path / "a", {"y": output()}, samples)
    samples[k] = {"y": np.array(k + 0.5)}
    found = first(then, record(tmp_path / "b", {"y": output()}, samples))
    assert (found.time, found.then, found.now) == (k * STEP, repr(float(k)), repr(k + 0.5))


@pytest.mark.parametrize(
    ("axes", "shapes"),
    [(("n",), [(2,), (3,)]), (("n", "m"), [(2, 2), (1, 4)]), (("n", 3), [(2, 3), (1, 3)])],
)
def test_another_size_is_told_and_no_element(
    axes: tuple[str | int, ...], shapes: list[tuple[int, ...]], tmp_path: Path
) -> None:
    both = [
        record(tmp_path / f"{n}", {"y": output(*axes)}, [{"y": np.zeros(each)}])
        for n, each in enumerate(shapes)
    ]
    found = first(*both)
    said = [f"of shape {' x '.join(map(str, each))}" for each in shapes]
    assert (found.time, found.element, [found.then, found.now]) == (0, (), said)


def test_bytes_are_compared_and_not_numbers(tmp_path: Path) -> None:
    both = [
        record(tmp_path / f"{n}", {"y": output()}, [{"y": np.array(each)}])
        for n, each in enumerate([0.0, -0.0])
    ]
    found = first(*both)
    assert (found.then, found.now) == ("0.0", "-0.0")


def test_what_is_not_recorded_or_of_another_kind_is_said_first(tmp_path: Path) -> None:
    y, x = np.array(1.0), np.array(2)
    then = record(
        tmp_path / "a",
        {"y": output(), "gone": output(), "kind": output(unit="m")},
        [{"y": y, "gone": y, "kind": y}],
    )
    now = record(
        tmp_path / "b",
        {"y": output(), "new": output(), "kind": output(dtype=np.int64, unit="m")},
        [{"y": np.array(-1.0), "new": y, "kind": x}],
    )
    found = {each.signal: (each.time, each.then, each.now) for each in differences(then, now)}
    assert found == {
        "source.gone": (None, "recorded", "not recorded"),
        "source.kind": (None, "float64[] in m", "int64[] in m"),
        "source.new": (None, "not recorded", "recorded"),
        "source.y": (0, "1.0", "-1.0"),
    }
    assert list(found)[-1] == "source.y"


def test_a_run_that_ends_earlier_does_not_publish_what_follows(tmp_path: Path) -> None:
    samples = [{"y": np.array(1.0)}] * 5
    then = record(tmp_path / "a", {"y": output()}, samples)
    now = record(tmp_path / "b", {"y": output()}, samples[:3])
    for one, other, said in [(then, now, False), (now, then, True)]:
        found = first(one, other)
        words = ("published", "not published")
        assert (found.time, (found.then, found.now)) == (3 * STEP, words[::-1] if said else words)


def test_another_step_is_another_time(tmp_path: Path) -> None:
    samples = [{"y": np.array(1.0)}] * 3
    then = record(tmp_path / "a", {"y": output()}, samples)
    now = record(tmp_path / "b", {"y": output()}, samples, step=STEP // 2)
    found = first(then, now)
    assert (found.time, found.then, found.now) == (STEP // 2, "not published", "published")


def test_the_earliest_stands_first_and_at_one_time_the_order_of_turns_counts(
    tmp_path: Path,
) -> None:
    def made(name: str, late: int, wrong: float) -> Recording:
        def source(from_step: int) -> FunctionComponent:
            return FunctionComponent(
                {"y": output()},
                lambda state, inputs, t: (None, {"y": np.array(wrong * (t >= from_step * STEP))}),
            )

        system = System(
            {"a": source(2), "b": source(2), "c": source(late)}, dict.fromkeys("abc", STEP), []
        )
        recorder = Recorder(tmp_path / name, manifest={"turns": ["b", "a", "c"]})
        simulate(system, Jacobi(), start=0, stop=4 * STEP, seed=0, observers=[recorder])
        return Recording(tmp_path / name)

    found = differences(made("x", 1, 0.0), made("y", 1, 1.0))
    assert [(each.signal, each.time) for each in found] == [
        ("c.y", STEP),
        ("b.y", 2 * STEP),
        ("a.y", 2 * STEP),
    ]


def test_it_reads_as_a_sentence() -> None:
    found = Difference(signal="a.y", time=1_500_000_000, element=(1, 2), then="1.0", now="2.0")
    assert str(found) == "`a.y[1, 2]` at t = 1.5 s was 1.0, and is 2.0"
