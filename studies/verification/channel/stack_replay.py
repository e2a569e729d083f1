"""Runs the channel through the positions and frames of a recorded run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.messages.records import NO_VEHICLE, PACKET, RECEPTION, TRANSMISSION
from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_run import Frames, StackRun

_LONGEST_FRAME: Final = 20_000_000
"""4095 bytes at 3 Mbit/s take 11 ms; the last one is heard to its end."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What the channel said in one step.

    Attributes:
        receptions: RECEPTION records; the id of a packet is its index in `Frames`.
        transmissions: TRANSMISSION records.
    """

    receptions: Array
    transmissions: Array


def replay(
    channel: ChannelUnderTest, run: StackRun, parameters: Mapping[str, Any], times: Array
) -> Iterator[StepResult]:
    """Step from update to update, each step with the positions of its beginning.

    After the last update comes one more step without packets, in which the last frames end.

    Args:
        channel: the channel.
        run: the recorded run.
        parameters: beside those of the run.
        times: when the packet of each frame is handed over [ns], shape (frame,).
    """
    updates, h = run.updates, run.parameters.interval
    order = np.argsort(times, kind="stable")
    packets = _packets(run, times)[order]
    cuts = np.searchsorted(packets["time"], [update.time for update in updates[1:]])
    handed = np.split(packets, cuts)
    first = {**updates[0].vehicles, **scene.buildings(run.rings)}
    values = {**run.parameters.channel, **parameters}
    with channel.start(values, first, at=updates[0].time) as session:
        for update, records in zip(updates, handed, strict=True):
            received = session.send(records, update.vehicles, h=h)
            yield StepResult(received, session.transmissions())
        received = session.send(packets[:0], h=-(-_LONGEST_FRAME // h) * h)
        yield StepResult(received, session.transmissions())


def steps(run: StackRun) -> int:
    """How many results `replay` yields."""
    return len(run.updates) + 1


def _packets(run: StackRun, times: Array) -> Array:
    frames: Frames = run.frames
    packets = np.zeros(len(times), PACKET)
    packets["id"] = np.arange(len(times))
    packets["time"] = times
    packets["source"] = frames.vehicle
    packets["destination"], packets["route"] = NO_VEHICLE, NO_VEHICLE
    packets["size"] = run.parameters.size
    packets["access_category"] = run.parameters.access_category
    return packets


def together(results: list[StepResult]) -> StepResult:
    """All results as one."""
    return StepResult(
        np.concatenate([np.empty(0, RECEPTION), *(one.receptions for one in results)]),
        np.concatenate([np.empty(0, TRANSMISSION), *(one.transmissions for one in results)]),
    )
