"""What a way of sharing costs and brings: `python -m studies.red_light.sharing_cost RUN [RUN ...]`.

Each RUN is a directory of `nlosim run` of the red-light study. Prints one row of a table
(Markdown), in each column the values of all runs.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.records import BSM, SENSOR_DATA
from orchestrator.recording import Recording as RecordedRun
from orchestrator.tables import CLOSE, left, markdown
from studies.red_light import metrics
from studies.red_light.roles import SHARING
from studies.red_light.traces import Array, Recording, Traces

COLUMNS: Final = left(
    "collision",
    "smallest gap to the hidden vehicle [m]",
    "PRR",
    "known [s]",
    "kilobytes",
    "of these data of the sharing node",
    "mean busy ratio",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SharingCost:
    """What the sharing of one run costs and brings.

    Attributes:
        collision: whether the bodies overlapped.
        gap: smallest distance to the hidden vehicle [m]; None if it never entered.
        prr: share of the packets of sensor data or CPMs for the ego that reached it; None if none
            was sent.
        known: when the ego first knew of the hidden vehicle [s]; None if it never did.
        bytes: size of everything but BSMs that was handed to the radios [B].
        data_bytes: size of the sensor data or CPMs of the sharing node among that [B].
        busy_ratio: mean over time of the mean over the vehicles.
    """

    collision: bool
    gap: float | None
    prr: float | None
    known: float | None
    bytes: int
    data_bytes: int
    busy_ratio: float


def sharing_cost(recording: Recording) -> SharingCost:
    """The figures of a recorded run."""
    traces = Traces(recording)
    found = metrics.compute(traces)
    sent = traces.packets
    shared = sent[sent["kind"] != BSM]
    from_sharing = shared["source"] == traces.vehicle_with(SHARING)
    data = shared[(shared["kind"] == SENSOR_DATA) & from_sharing]
    return SharingCost(
        collision=found.collision,
        gap=found.min_gap_m,
        prr=found.prr.end_to_end,
        known=found.hidden_vehicle.received_by_ego,
        bytes=int(shared["size"].sum()),
        data_bytes=int(data["size"].sum()),
        busy_ratio=_busy_ratio(traces),
    )


def row(costs: Sequence[SharingCost]) -> list[str]:
    """The cells of runs that differ in their seeds."""
    columns = (
        ["yes" if cost.collision else "no" for cost in costs],
        [_number(cost.gap, ".2f") for cost in costs],
        [_number(cost.prr, ".2f") for cost in costs],
        [_number(cost.known, ".1f") for cost in costs],
        [f"{cost.bytes / 1e3:.0f}" for cost in costs],
        [f"{cost.data_bytes / 1e3:.0f}" for cost in costs],
        [f"{cost.busy_ratio:.2f}" for cost in costs],
    )
    return [", ".join(column) for column in columns]


def _busy_ratio(traces: Traces) -> float:
    """The mean of the points with vehicles; 0 if there is none."""
    series = traces.series("channel.busy_ratio")
    ratios: list[Array] = [np.asarray(series[k]) for k in range(len(series))]
    means = [float(of_vehicles.mean()) for of_vehicles in ratios if len(of_vehicles)]
    return float(np.mean(means)) if means else 0.0


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def main(runs: Sequence[str]) -> None:
    """The command line."""
    costs = [sharing_cost(RecordedRun(Path(run))) for run in runs]
    sys.stdout.write("\n".join(markdown(COLUMNS, [row(costs)], CLOSE)) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
