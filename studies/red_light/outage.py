"""When the direct link is out, and when the ego brakes.

    python -m studies.red_light.outage RUN [RUN ...]

Each RUN is a directory of `nlosim run scenarios/red_light_driving.yaml --set
components.relay.type=relay-direct`. Prints a table (Markdown) with one row per run.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.records import OUTCOMES, SENSOR_DATA
from orchestrator.recording import Recording as RecordedRun
from studies.method.text import markdown
from studies.red_light.metrics import compute
from studies.red_light.roles import COLLISION, EGO
from studies.red_light.traces import Array, Recording, Traces

MAX_BRAKING: Final = 8.0
"""Deceleration of the ego under full brakes [m/s^2], the default of `sumo-traffic`."""
ACTUATOR_LAG: Final = 0.1
"""Time constant of its brakes [s], the default of `sumo-traffic`."""
_SECOND: Final = 1_000_000_000
_RECEIVED: Final = OUTCOMES.index("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outage:
    """When the direct link of one run was out, and when its ego braked.

    Attributes:
        sent: packets of sensor data handed to the sharing node's radio for the ego, by the second
            of the run, shape (second,).
        received: those of them that reached the ego over the direct link, shape (second,).
        silence: the longest time without such a reception, from and to [s]; None if fewer than two
            arrived.
        braked: when the ego first used its brakes by more than a tenth [s]; None if it never did.
        last_moment: until when full brakes, at the speed that the ego had at `braked`, would have
            stopped it before the collision vehicle's path [s]; None if it never braked.
        collision: whether the bodies overlapped.
    """

    sent: Array
    received: Array
    silence: tuple[float, float] | None
    braked: float | None
    last_moment: float | None
    collision: bool


def outage(recording: Recording) -> Outage:
    """The figures of a recorded run."""
    traces = Traces(recording)
    found = compute(traces)
    packets, arrivals = _sent(traces), _arrivals(traces)
    arrived = np.isin(packets["id"], arrivals["packet"])
    seconds = traces.end // _SECOND + 1
    braked = found.braking.pedal
    return Outage(
        sent=np.bincount(packets["time"] // _SECOND, minlength=seconds),
        received=np.bincount(packets["time"][arrived] // _SECOND, minlength=seconds),
        silence=_silence(arrivals["time"] / _SECOND),
        braked=braked,
        last_moment=None if braked is None else _last_moment(traces, braked),
        collision=found.collision,
    )


def table(runs: Sequence[tuple[str, Outage]]) -> str:
    """A row per run: of the packets sent in a second how many arrived, second by second."""
    first = min(int(np.argmax(run.sent > 0)) for _, run in runs)
    last = max(len(run.sent) for _, run in runs)
    head = ["run", *(f"{k} s" for k in range(first, last)), "silence [s]", "brakes [s]"]
    rows = [[name, *_cells(run, first, last)] for name, run in runs]
    return markdown([*head, "full brakes until [s]", "collision"], rows)


def _sent(traces: Traces) -> Array:
    packets = traces.packets
    for_ego = packets["destination"] == traces.vehicle_with(EGO)
    return np.asarray(packets[for_ego & (packets["kind"] == SENSOR_DATA)])


def _arrivals(traces: Traces) -> Array:
    """Receptions by the ego of what was sent to it, in one hop."""
    heard = traces.receptions
    direct = (heard["hop"] == 0) & (heard["addressed"] == 1) & (heard["outcome"] == _RECEIVED)
    return np.asarray(heard[direct & (heard["receiver"] == traces.vehicle_with(EGO))])


def _silence(times: Array) -> tuple[float, float] | None:
    if len(times) < 2:
        return None
    longest = int(np.argmax(np.diff(times)))
    return float(times[longest]), float(times[longest + 1])


def _last_moment(traces: Traces, braked: float) -> float | None:
    """The ego drives north, the collision vehicle east; None without one, or if the ego stands."""
    scene = traces.scene(round(braked * _SECOND))
    ego, hidden = scene.row(EGO), scene.row(COLLISION)
    if ego is None or hidden is None:
        return None
    speed = float(np.hypot(*scene.velocity[ego, :2]))
    if speed == 0.0:
        return None
    front = scene.corners([ego])[0, :, 1].max()
    path = scene.corners([hidden])[0, :, 1].min()
    stopping = speed * ACTUATOR_LAG + speed**2 / (2.0 * MAX_BRAKING)
    return braked + float(path - front - stopping) / speed


def _cells(run: Outage, first: int, last: int) -> list[str]:
    counts = [
        f"{run.received[k]}/{run.sent[k]}" if k < len(run.sent) else "" for k in range(first, last)
    ]
    silence = "-" if run.silence is None else f"{run.silence[0]:.1f} to {run.silence[1]:.1f}"
    times = ["-" if time is None else f"{time:.2f}" for time in (run.braked, run.last_moment)]
    return [*counts, silence, *times, "yes" if run.collision else "no"]


def main(runs: Sequence[str]) -> None:
    """The command line."""
    found = [(Path(run).name, outage(RecordedRun(Path(run)))) for run in runs]
    sys.stdout.write(f"{table(found)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
