"""Runs of the encounters, and who could see whom in them."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import scenarios
from adapters.traffic.geometry import Boxes
from orchestrator.cli import main
from orchestrator.recording import Recording
from tests.adapters.sight import cut

Float = npt.NDArray[np.float64]

EGO, COLLIDER, SHARER = range(3)
"""Numbers in the order of entry: that of their declarations."""
RANGE = 50.0
"""Of the lidar [m]."""
HIGH = 2.2
"""Bodies from this height on hide what is behind them from a lidar on the roof of a car [m]."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A finished run: its metrics and its recording."""

    metrics: dict[str, Any]
    recording: Recording

    @property
    def times(self) -> Float:
        """The communication points of the traffic [s], shape (time,)."""
        return np.asarray(self.recording["traffic.vehicle.id"].times) / 1e9

    def before(self, time: float) -> range:
        """The rows of the communication points before `time` [s]."""
        return range(int(np.searchsorted(self.times, time)))

    def way(self, begin: int, end: int) -> float:
        """How far the ego vehicle came between two rows [m]."""
        places = np.array([self._at("traffic.ego.position", k)[:2] for k in range(begin, end)])
        return float(np.hypot(*np.diff(places, axis=0).T).sum())

    def speed(self, row: int) -> float:
        """Of the ego vehicle [m/s]."""
        return float(self._at("traffic.ego.speed", row))

    def aside(self, rows: Sequence[int]) -> Float:
        """How far left of its own lane the ego vehicle is, which goes east [m], shape (row,)."""
        lane = self._at("traffic.ego.position", 0)[1]
        return np.array([self._at("traffic.ego.position", k)[1] - lane for k in rows])

    def sees(self, row: int, observer: int, *, is_hidden_by_bodies: bool) -> bool:
        """Whether `observer` sees some of the collider's body from above the middle of its own.

        Args:
            row: of the communication point.
            observer: number of the vehicle.
            is_hidden_by_bodies: or by buildings alone.
        """
        ids = self._at("traffic.vehicle.id", row).tolist()
        center = self._at("traffic.vehicle.position", row)[:, :2]
        size = self._at("traffic.vehicle.size", row)
        corners = Boxes(
            center=center, heading=self._at("traffic.vehicle.heading", row), size=size[:, :2]
        ).corners()
        seen, sensor = ids.index(COLLIDER), center[ids.index(observer)]
        obstacles = self._buildings(row)
        if is_hidden_by_bodies:
            obstacles += [corners[k] for k in np.flatnonzero(size[:, 2] >= HIGH) if k != seen]
        points = np.concatenate([center[seen][None], corners[seen], _middles(corners[seen])])
        start = np.broadcast_to(sensor, points.shape)
        free = np.hypot(*(points - start).T) <= RANGE
        for obstacle in obstacles:
            free &= ~cut(start, points, obstacle)
        return bool(free.any())

    def _buildings(self, row: int) -> list[Float]:
        vertex = self._at("traffic.building.vertex", row)
        index = self._at("traffic.building.index", row)
        return [vertex[index == k] for k in np.unique(index)]

    def _at(self, name: str, row: int) -> npt.NDArray[Any]:
        series = self.recording[name]
        return np.asarray(series.at(round(self.times[row] * 1e9)))


NO_MEASURES = "measures={}"
"""Of a scenario that asks none by itself: what is tested are the metrics of its report."""


def run(
    name: str,
    policy: str,
    seed: int,
    out: Path,
    capsys: pytest.CaptureFixture[str],
    *changes: str,
) -> Run:
    """Run a scenario that ships, with a policy and further changes; it must succeed."""
    capsys.readouterr()
    options: list[str] = [
        "--seed", str(seed), "--no-figure", "--quiet", "--json", "--out", str(out),
    ]  # fmt: skip
    for change in (f"components.policy.type={policy}", *changes):
        options += ["--set", change]
    scenario = Path(scenarios.__file__).with_name(f"{name}.yaml")
    code = main(["run", str(scenario), *options])
    captured = capsys.readouterr()
    assert code == 0, captured.out + captured.err
    return Run(metrics=json.loads(captured.out)["metrics"], recording=Recording(out))


def _middles(corners: Float) -> Float:
    return np.asarray(0.5 * (corners + np.roll(corners, -1, axis=0)))
