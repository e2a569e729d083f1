"""How soon a page is there, and how it plays, in a headless browser."""

import atexit
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from typing_extensions import override

import scenarios
from benchmarks.benchmark import Case, Measurement, PeerFailedError
from benchmarks.viewer.chromium import NoBrowserError, Tab, browser
from orchestrator.page.page import make_page
from orchestrator.recording import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario

_SCENARIO: Final = Path(scenarios.__file__).with_name("city.yaml")
_DEMAND: Final = 1000
"""Vehicles of the scenario, which are scaled to fewer."""

_WINDOW: Final = (1440, 900)
_IDLE: Final = 2.0
_PLAYED: Final = 5.0
"""How long frames are counted [s], of an empty page and of one that plays."""

_MS: Final = 1e3
_MB: Final = 1e6

_FIRST: Final = """\
globalThis.firstPicture = 0;
(function look() {
  const page = globalThis.NLOSIM && NLOSIM.page;
  if (page && page.ready) requestAnimationFrame(() => { firstPicture = performance.now(); });
  else requestAnimationFrame(look);
})();
"""
"""Notes when the first picture is there, since the navigation [ms]."""

_EMPTY: Final = """\
new Promise((done) => {{
  const at = [];
  const next = (now) => {{
    at.push(now);
    if (now - at[0] < {span}) requestAnimationFrame(next); else done(at);
  }};
  requestAnimationFrame(next);
}})
"""
_PLAY: Final = """\
new Promise((done) => {{
  const {{ clock }} = NLOSIM.page;
  const at = [], spent = [];
  const tick = clock.tick.bind(clock);
  clock.tick = (now) => {{
    const began = performance.now();
    if (now - (at[0] || now) >= {span}) clock.play(false);
    tick(now);
    spent.push(performance.now() - began);
    at.push(now);
    if (clock.playing) return;
    delete clock.tick;
    done([at, spent]);
  }};
  clock.seek(0);
  clock.speed = {speed};
  clock.play(true);
}})
"""
"""Times of frames, and how long the page's own code took for each [ms]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class City:
    """A run of the city, and its page; made when it is first asked for.

    Attributes:
        vehicles: how many are there from the first second on.
        seconds: simulated [s].
    """

    vehicles: int
    seconds: int

    @cached_property
    def page(self) -> Path:
        """The page."""
        return self.directory / "index.html"

    @cached_property
    def directory(self) -> Path:
        """The directory of the run, which goes when this process does."""
        folder = Path(tempfile.mkdtemp(prefix="nlosim-page-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        out = folder / "run"
        scale = f"components.traffic.parameters.scale={self.vehicles / _DEMAND}"
        sets = [f"time.stop={self.seconds} s", scale, "measures={}"]
        run_scenario(load_scenario(_SCENARIO, sets), out, figure=False)
        make_page(out)
        return out

    @cached_property
    def present(self) -> float:
        """How many road users are there at a time, on average."""
        return float(np.mean(Recording(self.directory)["traffic.vehicle.id"].lengths))


@dataclass(frozen=True, kw_only=True, eq=False)
class Playing(Case):
    """The page of a run is opened in a new browser, and played.

    Attributes:
        city: the run.
    """

    city: City

    @override
    def measure(self) -> Measurement:
        """Open and play it once.

        Returns:
            `open_s`: wall time from the navigation to the first picture; `limit_fps`: frames per
            second of an empty page in the same browser; `fps`: while the page plays; `frame_ms` and
            `frame_p99_ms`: what the page's own code takes of a frame; `browser_ms`: CPU time of all
            processes of the browser for a frame; `late_percent`: frames that
            came later than 1.5 times the usual time after the one before; `heap_mb`: of JavaScript
            afterwards; `page_kb`; `vehicles`.
        """
        try:
            with tempfile.TemporaryDirectory() as folder, browser(Path(folder)) as tab:
                page = self.city.page
                return {
                    **_seen(tab, page, self.city.seconds),
                    "page_kb": page.stat().st_size / 1e3,
                    "vehicles": self.city.present,
                }
        except NoBrowserError as error:
            raise PeerFailedError(str(error)) from None


def _seen(tab: Tab, page: Path, seconds: int) -> Measurement:
    tab.resize(*_WINDOW)
    empty = tab.evaluate(_EMPTY.format(span=_IDLE * _MS))
    tab.call("Page.addScriptToEvaluateOnNewDocument", source=_FIRST)
    tab.call("Page.navigate", url=page.as_uri())
    tab.wait("globalThis.firstPicture")
    first = tab.evaluate("firstPicture")
    tab.frames(10)
    speed = min(1.0, seconds / (1.5 * _PLAYED))
    before = tab.processor_time()
    at, spent = tab.evaluate(_PLAY.format(span=_PLAYED * _MS, speed=speed))
    drawing = tab.processor_time() - before
    tab.call("HeapProfiler.collectGarbage")
    heap = tab.evaluate("performance.memory.usedJSHeapSize")
    return {
        "open_s": first / _MS,
        "limit_fps": rate(empty),
        "heap_mb": heap / _MB,
        "browser_ms": drawing * _MS / len(at),
        **smoothness(at, spent),
    }


def rate(at: Sequence[float]) -> float:
    """Frames per second of frames at times [ms]."""
    return (len(at) - 1) * _MS / (at[-1] - at[0])


def smoothness(at: Sequence[float], spent: Sequence[float]) -> Mapping[str, float]:
    """How smoothly a page played.

    Args:
        at: times of its frames [ms].
        spent: what its code took of each [ms].
    """
    between = np.diff(at)
    return {
        "fps": rate(at),
        "frame_ms": float(np.median(spent)),
        "frame_p99_ms": float(np.percentile(spent, 99)),
        "late_percent": 100 * float((between > 1.5 * np.median(between)).mean()),
    }
