"""The benchmark of pages: what its cases give, and what is made of the measurements."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from benchmarks.benchmark import Measurement, Row
from benchmarks.harness import measure
from benchmarks.settings import WholeNumberError
from benchmarks.viewer import PageBenchmark
from benchmarks.viewer.chromium import browser_path
from benchmarks.viewer.following import Run
from benchmarks.viewer.playing import City, Playing, rate, smoothness

needs_a_browser = pytest.mark.skipif(browser_path() is None, reason="no browser")


def test_a_rate_counts_the_frames_between_the_first_and_the_last() -> None:
    assert rate([0.0, 10.0, 30.0, 100.0]) == 30.0


def test_a_frame_that_is_late_counts_as_one() -> None:
    at = [20.0 * k for k in range(9)] + [20.0 * 10]  # one picture is missing
    found = smoothness(at, [1.0] * 9 + [11.0])
    assert found["late_percent"] == pytest.approx(100 / 9)
    assert found["fps"] == pytest.approx(45.0)
    assert found["frame_ms"] == 1.0
    assert 9.0 < found["frame_p99_ms"] < 11.0


PLAYED: Mapping[str, float] = {
    "open_s": 0.5,
    "limit_fps": 60.0,
    "fps": 45.0,
    "frame_ms": 2.0,
    "frame_p99_ms": 9.0,
    "browser_ms": 14.0,
    "late_percent": 3.0,
    "heap_mb": 12.0,
    "page_kb": 600.0,
    "vehicles": 100.0,
}


def rows(measured: Mapping[str, list[Measurement]]) -> dict[str, Row]:
    return {row.case: row for row in PageBenchmark().rows(measured)}


def test_rows_compare_with_the_target_with_an_empty_page_and_with_nobody_who_follows() -> None:
    alone: list[Measurement] = [{"wall_s": wall, "cpu_s": 4.0} for wall in (9.0, 10.0, 20.0)]
    one = {"wall_s": 12.5, "cpu_s": 4.4, "pages": 3.0, "view_cpu_s": 1.0, "browser_cpu_s": 5.0}
    followed: list[Measurement] = [one] * 3
    found = rows({"100 vehicles": [PLAYED], "run/alone": alone, "run/followed": followed})
    assert set(found) == {"open/100 vehicles", "play/100 vehicles", "follow/red_light"}
    assert found["open/100 vehicles"].ratio == 6.0
    assert found["play/100 vehicles"].ratio == 0.75
    assert found["play/100 vehicles"].details["frame_p99_ms"] == 9.0
    assert found["follow/red_light"].ratio == pytest.approx(10.0 / 12.5)
    assert found["follow/red_light"].details["peer_cpu_s"] == 4.0
    assert rows({"run/followed": followed})["follow/red_light"].ratio is None


def test_settings_are_whole_numbers_and_cases_take_them() -> None:
    benchmark = PageBenchmark()
    benchmark.configure({"seconds": "3", "long": "7"})
    assert list(benchmark.cases()) == [
        "100 vehicles", "1000 vehicles", "7 s", "run/alone", "run/followed",
    ]  # fmt: skip
    with pytest.raises(WholeNumberError, match="`long` is `0`"):
        benchmark.configure({"long": "0"})


def test_without_a_browser_its_cases_are_left_out_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NLOSIM_BROWSER", raising=False)
    monkeypatch.setenv("PATH", str(Path(__file__).parent))
    benchmark = PageBenchmark()
    benchmark.configure({"seconds": "1"})
    found = measure(benchmark, repeat=1, pattern="100 vehicles")
    assert found.rows == ()
    assert list(found.left_out) == ["100 vehicles"]
    assert found.left_out["100 vehicles"].startswith("no browser: none of chromium, ")


@needs_a_browser
@pytest.mark.slow
def test_a_page_is_opened_and_played() -> None:
    found = Playing(city=City(vehicles=20, seconds=2)).measure()
    assert found["open_s"] > 0.0
    assert min(found["fps"], found["limit_fps"]) > 0.0
    assert 0.0 < found["frame_ms"] <= found["frame_p99_ms"]
    assert found["vehicles"] == pytest.approx(20, rel=0.4)
    assert 1.0 < found["heap_mb"] < 500.0
    assert found["browser_ms"] > 0.0


@needs_a_browser
@pytest.mark.slow
def test_a_run_is_followed_to_its_end() -> None:
    alone, followed = (Run(seconds=4, is_followed=is_followed) for is_followed in (False, True))
    assert set(alone.measure()) == {"wall_s", "cpu_s"}
    found = followed.measure()
    assert found["pages"] >= 0.0  # it may be over before a page is there, on a busy machine
    assert found["browser_cpu_s"] > 0.0
    assert 0.0 < found["cpu_s"] < found["wall_s"] * 4
