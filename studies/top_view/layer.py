"""The layer of the page, found by the entry point `top-view`."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.page.layer import Content, Curve, PageLayer, PageOfRun
from studies.top_view.crowd import Crowd, crowd_of
from studies.top_view.ground import ground_of
from studies.top_view.radio import radio_of
from studies.top_view.sensing import sensing_of
from studies.top_view.signals import Sources, entities_of, sources_of

_WEB: Final = Path(__file__).parent / "web"
SCRIPTS: Final = tuple(
    _WEB / f"{name}.js"
    for name in (
        "crowd", "radio", "knowledge", "camera", "ground", "bodies", "links", "flights", "sensing",
        "inspector", "packet", "pointer", "top_view",
    )
)  # fmt: skip
"""The scripts of the layer, in the order in which they are run."""

_WINDOW: Final = 100_000_000
"""Busy ratios are those of windows of so many nanoseconds."""


class TopView(PageLayer):
    """Everybody on the road from above: what they send, hear, see and know.

    Signals are known by what they are, not by the names of components: those of vehicles by
    `vehicle.id` and `vehicle.position`, messages by their MIME types. Without vehicles there is no
    top view.
    """

    @override
    def content(self, run: PageOfRun) -> Content | None:
        sources = sources_of(run.recording)
        if sources is None:
            return None
        crowd = crowd_of(run, sources.traffic)
        radio, curves = radio_of(run, sources, crowd)
        data = {
            "crowd": crowd.data,
            "ground": ground_of(run, sources.traffic),
            "entities": entities_of(run.manifest, sources.traffic),
            "egos": _numbers(run, crowd, sources.egos),
            "radio": radio,
            "sensing": sensing_of(run, sources, crowd),
            "relays": [_relay(run, crowd, name) for name in sources.relays],
        }
        shown = list(_shown(run, sources))
        return Content(data=data, curves=[*curves, *_busy(run, sources)], shown=shown)

    @override
    def scripts(self) -> Sequence[Path]:
        return SCRIPTS

    @override
    def styles(self) -> Sequence[Path]:
        return (_WEB / "top_view.css",)


def _numbers(run: PageOfRun, crowd: Crowd, egos: Mapping[str, str]) -> list[int]:
    """Who the egos are, places in the crowd."""
    found = []
    for name in egos:
        numbers = np.asarray(run.recording[name].values).reshape(-1)
        if len(numbers):
            found.append(int(crowd.index(numbers.max())))
    return [place for place in found if place >= 0]


def _shown(run: PageOfRun, sources: Sources) -> Iterator[str]:
    """Speeds and gaps of egos."""
    for quantity in ("speed", "gap"):
        for entity in list(sources.egos.values())[:4]:
            name = f"{sources.traffic}.{entity}.{quantity}"
            if name in run.recording:
                yield name


def _relay(run: PageOfRun, crowd: Crowd, name: str) -> Mapping[str, Any]:
    """Who was the relay, whenever that changed; -1: nobody."""
    series = run.recording[name]
    chosen = crowd.index(np.asarray(series.values).reshape(-1))
    changes = np.ones(len(chosen), bool)
    changes[1:] = chosen[1:] != chosen[:-1]
    return {
        "name": name,
        "times": run.times(series.times[changes]),
        "vehicle": run.arrays.add(chosen[changes], "i4"),
    }


def _busy(run: PageOfRun, sources: Sources) -> list[Curve]:
    """Mean and greatest busy ratio of all radios, once per window."""
    if not sources.busy:
        return []
    series = run.recording[sources.busy]
    wanted = np.arange(run.start, run.stop + 1, max(_WINDOW, (run.stop - run.start) // 1000))
    samples = np.unique(np.searchsorted(series.times, wanted, side="right") - 1)
    rows = [np.asarray(series[k]) for k in samples.tolist() if k >= 0]
    times = series.times[samples[samples >= 0]]
    found = []
    for name, of in (("busy ratio, mean", np.mean), ("busy ratio, greatest", np.max)):
        values = np.array([float(of(each)) if len(each) else np.nan for each in rows])
        curve = Curve(name=name, unit="1", times=times, values=values, shown=name.endswith("mean"))
        found.append(curve)
    return found
