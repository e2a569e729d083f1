"""`nlosim bench page`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.settings import whole_number
from benchmarks.spread import Spread
from benchmarks.viewer.following import Run
from benchmarks.viewer.playing import City, Playing

_SECONDS: Final = "seconds"
_LONG: Final = "long"
_COUNTS: Final = (100, 1000)
_LONG_COUNT: Final = 100

_FRAMES: Final = 60.0
_OPEN: Final = 3.0
"""Targets of the project: frames per second at 100 vehicles, and [s] to open 600 s."""

_ALONE: Final = "run/alone"
_FOLLOWED: Final = "run/followed"


class PageBenchmark(Benchmark):
    """Pages of runs in a browser."""

    def __init__(self) -> None:
        self._settings = {_SECONDS: "20", _LONG: "600"}

    @property
    @override
    def description(self) -> str:
        return (
            "pages of runs in headless Chromium, without graphics hardware: wall time "
            "from the navigation to the first picture, frames per second while it plays, and the "
            "wall time of a run of the red light that a browser follows"
        )

    @property
    @override
    def peer(self) -> str:
        return (
            "of `open` the target of the project for 600 s; of `play` an empty page in the same "
            "browser, which draws nothing; of `follow` the same run without a follower, in turn"
        )

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return self._settings

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        self._settings = {**self._settings, **settings}
        for name in self._settings:
            whole_number(self._settings, name, 1)

    @override
    def cases(self) -> Mapping[str, Case]:
        seconds, long = (whole_number(self._settings, name, 1) for name in (_SECONDS, _LONG))
        cities = {f"{n} vehicles": City(vehicles=n, seconds=seconds) for n in _COUNTS}
        cities[f"{long} s"] = City(vehicles=_LONG_COUNT, seconds=long)
        return {
            **{name: Playing(city=city) for name, city in cities.items()},
            _ALONE: Run(seconds=seconds, is_followed=False),
            _FOLLOWED: Run(seconds=seconds, is_followed=True),
        }

    @override
    def rows(self, measured: Mapping[str, Sequence[Measurement]]) -> Sequence[Row]:
        return [*_opened(measured), *_played(measured), *_followed(measured)]


def _pages(
    measured: Mapping[str, Sequence[Measurement]],
) -> Iterator[tuple[str, Sequence[Measurement]]]:
    for name, repetitions in measured.items():
        if "fps" in repetitions[0]:
            yield name, repetitions


def _opened(measured: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    for name, repetitions in _pages(measured):
        yield Row.of(
            f"open/{name}",
            Spread.of(each["open_s"] for each in repetitions),
            "s",
            peer=_OPEN,
            peer_name="target",
            is_higher_better=False,
            details=_medians(repetitions, "page_kb", "vehicles"),
        )


def _played(measured: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    for name, repetitions in _pages(measured):
        details = ("frame_ms", "frame_p99_ms", "browser_ms", "late_percent", "heap_mb", "vehicles")
        yield Row.of(
            f"play/{name}",
            Spread.of(each["fps"] for each in repetitions),
            "frames / s",
            peer=_median(repetitions, "limit_fps"),
            peer_name="empty page",
            details={**_medians(repetitions, *details), "target_fps": _FRAMES},
        )


def _followed(measured: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    if _FOLLOWED not in measured:
        return
    followed, alone = measured[_FOLLOWED], measured.get(_ALONE, ())
    cpu = {"peer_cpu_s": _median(alone, "cpu_s")} if alone else {}
    yield Row.of(
        "follow/red_light",
        Spread.of(each["wall_s"] for each in followed),
        "s",
        peer=_median(alone, "wall_s") if alone else None,
        peer_name="not followed",
        is_higher_better=False,
        details={**_medians(followed, "cpu_s", "view_cpu_s", "browser_cpu_s", "pages"), **cpu},
    )


def _median(repetitions: Sequence[Measurement], name: str) -> float:
    return Spread.of(each[name] for each in repetitions).median


def _medians(repetitions: Sequence[Measurement], *names: str) -> Mapping[str, float]:
    return {name: _median(repetitions, name) for name in names}
