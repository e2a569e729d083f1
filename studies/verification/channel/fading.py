"""`nakagami_stats.csv`: distribution of the fading factor over many draws.

A transmitter and many receivers at one distance: every frame is a draw for each receiver. What the
path loss leaves is the mean; the received power over it is the factor.

Both sides are samples. The mean and the share of factors equal to 1 are compared in units of the
standard deviation of their difference. A golden quantile x of probability p is compared through the
share of our draws up to x: whatever the distribution, its difference to p has a standard deviation
of sqrt(p (1 - p) (1 / n + 1 / m)) for n and m draws, and no density is needed.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE, PACKET
from orchestrator.signal import Array
from studies.verification.channel.check import Advance, Check
from studies.verification.channel.comparison import SHOWN, Comparison, Series
from studies.verification.channel.golden_files import Table, number, read_table, whole
from studies.verification.channel.session import (
    MILLISECOND,
    VEINS_ANTENNA_HEIGHT,
    ChannelUnderTest,
    Session,
    link_inputs,
    vehicle_inputs,
)
from studies.verification.channel.tolerances import FADING

FADING_STATISTICS: Final = "nakagami_stats.csv"
_QUANTILES: Final = {"q01": 0.01, "q05": 0.05, "q10": 0.1, "q25": 0.25, "q50": 0.5, "q75": 0.75}
_RECEIVERS: Final = 1000
_MOST_DRAWS: Final = 500_000
_POWER: Final = 26.0
_EXACT: Final = 1e-9
"""Factors as near to 1 as this are 1: they are powers in dBm over losses in dB, both rounded."""


@dataclass(frozen=True, slots=True)
class _Deviation:
    """How far apart golden and our value of one statistic are, in standard deviations."""

    place: str
    golden: float
    ours: float
    sigma: float

    @property
    def size(self) -> float:
        """The distance [sigma]: 0 if both are equal; without any spread nothing else is allowed."""
        difference = abs(self.golden - self.ours)
        if difference <= _EXACT:
            return 0.0
        return difference / self.sigma if self.sigma > 0 else float("inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class FadingCheck(Check):
    """Statistics of the factor, one row of the file for each distribution."""

    table: Table

    @property
    @override
    def work(self) -> int:
        return len(self.table)

    @override
    def run(self, channel: ChannelUnderTest, advance: Advance) -> Comparison:
        found: list[_Deviation] = []
        for row in range(len(self.table)):
            found += self._deviations(row, _draws(channel, self._parameters(row), self._link(row)))
            advance()
        sizes = np.array([deviation.size for deviation in found])
        bad = np.flatnonzero(~(sizes <= FADING.limit))
        return Comparison(
            cases=len(found),
            largest=float(sizes.max()),
            unit=FADING.unit,
            tolerance=FADING.limit,
            misses=len(bad),
            notes=tuple(_sentence(found[k]) for k in bad[np.argsort(-sizes[bad])][:SHOWN]),
            series=(
                Series(
                    label="mean, share of 1, quantiles",
                    golden=np.array([deviation.golden for deviation in found]),
                    ours=np.array([deviation.ours for deviation in found]),
                    x=sizes,
                ),
            ),
        )

    def _parameters(self, row: int) -> dict[str, Any]:
        parameters: dict[str, Any] = {
            "model": "veins",
            "fading": "nakagami",
            "transmit_power": _POWER,
            "sensitivity": -200.0,
            "medium_access": False,
            "building_shadowing": False,
            "vehicle_shadowing": False,
            "seed": row + 1,
        }
        if self.table["const_m"][row]:
            shape = float(self.table["m_param"][row])
            parameters.update(fading_near_m=shape, fading_far_m=shape)
        return parameters

    def _link(self, row: int) -> tuple[float, int]:
        draws = min(int(self.table["draws"][row]), _MOST_DRAWS)
        return float(self.table["distance_m"][row]), draws

    def _deviations(self, row: int, factor: Array) -> list[_Deviation]:
        table, place = self.table, self.table.place(row)
        samples = 1 / len(factor) + 1 / int(table["draws"][row])
        spread = float(factor.std() * np.sqrt(samples))
        mean, one = float(table["mean_factor"][row]), float(table["fraction_equal_1"][row])
        found = [
            _Deviation(f"{place}: mean_factor", mean, float(factor.mean()), spread),
            _share(f"{place}: fraction_equal_1", one, _mean(factor >= 1 - _EXACT), samples),
        ]
        for name, probability in _QUANTILES.items():
            x = float(table[name][row])
            below, up_to = _mean(factor < x - _EXACT), _mean(factor <= x + _EXACT)
            share = _nearest(probability, below, up_to)
            found.append(_share(f"{place}: {name}", probability, share, samples))
        return found


def _mean(holds: Array) -> float:
    return float(holds.mean())


def _share(place: str, golden: float, ours: float, samples: float) -> _Deviation:
    """Compare two shares of independent draws; `samples` is 1 / n + 1 / m."""
    return _Deviation(place, golden, ours, float(np.sqrt(golden * (1 - golden) * samples)))


def _nearest(probability: float, below: float, up_to: float) -> float:
    """Choose the share that agrees best: any between two, if many draws equal a quantile."""
    return float(np.clip(probability, below, up_to))


def _sentence(deviation: _Deviation) -> str:
    return (
        f"{deviation.place}: golden {deviation.golden:.6g}, ours {deviation.ours:.6g}: "
        f"{deviation.size:.1f} sigma apart"
    )


def _draws(channel: ChannelUnderTest, parameters: dict[str, Any], link: tuple[float, int]) -> Array:
    """Draw factors over the mean received power, shape (draws,)."""
    distance, draws = link
    receivers = min(_RECEIVERS, draws)
    frames = -(-draws // receivers)
    front = np.zeros((receivers + 1, 2))
    front[1:, 0] = distance
    n = len(front)
    vehicles = vehicle_inputs(range(n), front, np.zeros(n), np.tile((4.0, 2.0, 1.5), (n, 1)))
    height = VEINS_ANTENNA_HEIGHT
    probe = link_inputs([0.0, 0.0, height], [distance, 0.0, height])
    with channel.start(parameters, {**vehicles, **probe}) as session:
        mean = _POWER - float(session.probed("path_loss")[0])
        power = _received(session, frames)
    return 10 ** ((power[:draws] - mean) / 10)


def _received(session: Session, frames: int) -> Array:
    """Send frames of vehicle 0, one after the other: the powers at all receivers [dBm]."""
    packets = np.zeros(frames, PACKET)
    packets["id"] = np.arange(frames)
    packets["time"] = np.arange(frames) * MILLISECOND
    packets["destination"], packets["route"], packets["size"] = NO_VEHICLE, NO_VEHICLE, 50
    power: Array = session.send(packets, h=(frames + 1) * MILLISECOND)["power_dbm"]
    return power


def read_fading(path: Path) -> FadingCheck:
    """Read statistics of the fading factor.

    Raises:
        GoldenError: the file is malformed.
    """
    shares = dict.fromkeys(("mean_factor", "fraction_equal_1", *_QUANTILES), number)
    columns = {"m_param": number, "distance_m": number, "const_m": whole, "draws": whole}
    table = read_table(path, FADING_STATISTICS, {**columns, **shares})
    for row in range(len(table)):
        if table["draws"][row] < 1 or table["distance_m"][row] <= 0 or table["m_param"][row] <= 0:
            raise table.problem(row, "draws, distance_m and m_param must be positive")
    return FadingCheck(tolerance=FADING, table=table)
