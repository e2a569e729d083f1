"""Channel busy ratio."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.measure import Answer
from orchestrator.palette import COLOURS
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording, Series
from orchestrator.signal import Array
from studies.measures.bins import spread
from studies.measures.style import LINES
from studies.measures.vehicles import Vehicles, beneath, vehicles_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelBusyRatio(Measure):
    """Share of time in which radios find the medium busy.

    The channel busy ratio (CBR) of ETSI TS 102 687 and TS 103 574: per radio and window of 100 ms
    the share of it in which the medium was busy. What is busy is the channel's to say; for ours,
    see docs/physics-packets.md. Every complete window of every radio counts once; vehicles without
    a radio do not. One that enters within a window was idle before.
    """

    by_default: ClassVar[bool] = True

    busy_ratio: str = parameter("channel.busy_ratio", doc="`component.connector`")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    window: float = parameter(0.1, unit="s", minimum=0.001, doc="of the channel (`busy_window`)")

    @override
    def signals(self) -> Sequence[str]:
        return (self.busy_ratio, *beneath(self.vehicle, "id", "position", "equipped"))

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        has_radio = vehicles.values(recording, f"{self.vehicle}.equipped").astype(bool)
        series = recording[self.busy_ratio]
        samples = _window_ends(series, round(self.window * 1e9))
        points = _points(series, samples, vehicles, self.busy_ratio)
        found = [
            np.asarray(series[k])[has_radio[vehicles.first[p] : vehicles.first[p + 1]]]
            for k, p in zip(samples.tolist(), points.tolist(), strict=True)
        ]
        values = np.concatenate([np.empty(0), *found])
        table = _over_time(series.times[samples] / 1e9, found)
        return Answer(
            numbers={
                **spread(values, "cbr", ""),
                "cbr_max": float(values.max()) if len(values) else None,
                "windows": len(samples),
                "values": len(values),
            },
            tables={"time": table},
            panel=lambda axes: _draw(axes, table),
        )


def _window_ends(series: Series, window: int) -> Array:
    """The samples at which windows end, shape (window,); before the first one there is no ratio."""
    if len(series) == 0:
        return np.empty(0, np.int64)
    since = series.times - series.times[0]
    newest = np.searchsorted(since, np.arange(window, since[-1] + 1, window), side="right") - 1
    return np.unique(newest)


def _points(series: Series, samples: Array, vehicles: Vehicles, name: str) -> Array:
    """The communication point of traffic of which a sample has the vehicles, shape (sample,).

    It is the newest one or, where the algorithm lets the channel go before traffic, the one before.

    Raises:
        ValueError: neither has as many vehicles.
    """
    lengths = np.array([len(np.asarray(series[k])) for k in samples.tolist()], np.int64)
    present = np.diff(vehicles.first)
    newest = vehicles.at(series.times[samples])
    before = np.searchsorted(vehicles.times, series.times[samples], side="left") - 1
    for points in (newest, before):
        if (points >= 0).all() and (present[points] == lengths).all():
            return np.asarray(points)
    raise ValueError(f"`{name}` is not of the same vehicles as those of the recording")


def _over_time(times: Array, found: list[Array]) -> dict[str, Array]:
    """Mean, 95th percentile and most of all radios in every window; NaN where there is none."""
    rows = [
        (each.mean(), np.quantile(each, 0.95), each.max()) if len(each) else (np.nan,) * 3
        for each in found
    ]
    mean, p95, most = np.array(rows).reshape(-1, 3).T
    radios = np.array([len(each) for each in found], np.int64)
    return {"time_s": times, "radios": radios, "mean": mean, "p95": p95, "max": most}


def _draw(axes: "Axes", table: dict[str, Array]) -> None:
    for name, colour, line in zip(("mean", "p95", "max"), COLOURS, LINES, strict=False):
        axes.plot(table["time_s"], table[name], line, color=colour, label=name, lw=1.0)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("channel busy ratio")
    axes.set_ylim(0.0, 1.02)
    axes.legend()
