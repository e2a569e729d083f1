"""Weak frames on air while positions change: Veins looks at the vehicles late."""

import dataclasses
from pathlib import Path

import numpy as np

from studies.verification.channel.session import (
    VEINS_ANTENNA_HEIGHT,
    ChannelUnderTest,
    vehicle_inputs,
)
from studies.verification.channel.stack_given_times import is_uncertain, late_powers, spanning
from studies.verification.channel.stack_replay import Pairs
from studies.verification.channel.stack_run import Frames, StackRun, Update, read_run

from .golden_sample import GOLDEN, RUN

UPDATE = 200_000_000
HOUSE = [[200.0, -50.0], [260.0, -50.0], [260.0, 50.0], [200.0, 50.0]]  # 2 walls, 60 m: 42 dB
POWER_BEHIND_IT = 26 - 47.8443 - 20 * np.log10(300) - 42.0  # free space at 5.89 GHz [dBm]


def update(time: int, truck: float) -> Update:
    """A transmitter, a receiver 300 m ahead, and a high truck between them or beside."""
    front = np.array([[0.0, 0.0], [300.0, 0.0], [100.0, truck]])
    size = [[4.0, 2.0, 1.5], [4.0, 2.0, 1.5], [12.0, 2.5, 4.0]]
    vehicles = vehicle_inputs([0, 1, 2], front, np.zeros(3), size)
    return Update(time, vehicles, np.insert(front, 2, VEINS_ANTENNA_HEIGHT, axis=1))


def run(*starts: int, house: bool = True) -> StackRun:
    """Frames of vehicle 0; the truck drives in between at the update."""
    known = read_run(Path(GOLDEN / RUN))
    n = len(starts)
    channel = {**known.parameters.channel, "path_loss": "exponent", "path_loss_exponent": 2.0}
    return dataclasses.replace(
        known,
        parameters=dataclasses.replace(known.parameters, channel=channel),
        names=("a", "b", "truck"),
        rings=(HOUSE,) if house else (),
        updates=(update(UPDATE - 100_000_000, 20.0), update(UPDATE, 0.0)),
        frames=Frames(
            vehicle=np.zeros(n, np.int64),
            sequence=np.arange(n),
            queued=np.array(starts),
            start=np.array(starts),
            duration=np.full(n, 312_000),
            antenna=np.tile([0.0, 0.0, VEINS_ANTENNA_HEIGHT], (n, 1)),
        ),
    )


def event(golden: float, ours: float) -> Pairs:
    """Frame 0 at vehicle 1."""
    one = np.ones(1, np.int64)
    return Pairs(
        frame=0 * one,
        receiver=one,
        golden=5 * one,
        ours=5 * one,
        link=2 * one,
        distance=300.0 * one,
        power=np.array([[golden, ours]]),
        snir=np.full((1, 2), np.nan),
    )


def test_frames_that_end_after_an_update_are_found() -> None:
    starts = (UPDATE - 312_001, UPDATE - 312_000, UPDATE - 1, UPDATE)
    assert spanning(run(*starts)).tolist() == [1, 2]


def test_a_weak_frame_may_have_the_loss_of_the_new_bodies(channel: ChannelUnderTest) -> None:
    """The truck costs what the channel says of it; the house has made the frame weak before."""
    spans = run(UPDATE - 1000)
    (late,) = late_powers(channel, spans, event(golden=-200.0, ours=POWER_BEHIND_IT))
    assert POWER_BEHIND_IT - 30 < late < POWER_BEHIND_IT - 10
    (early,) = late_powers(channel, spans, event(golden=POWER_BEHIND_IT, ours=POWER_BEHIND_IT))
    assert early == POWER_BEHIND_IT


def test_no_other_frame_may(channel: ChannelUnderTest) -> None:
    wrong = event(golden=-200.0, ours=POWER_BEHIND_IT)
    assert late_powers(channel, run(UPDATE - 400_000), wrong) == POWER_BEHIND_IT  # ended before
    strong = run(UPDATE - 1000, house=False)
    assert late_powers(channel, strong, wrong) == POWER_BEHIND_IT


def test_the_snir_of_frames_that_meet_it_is_uncertain() -> None:
    frames = run(UPDATE - 1000, UPDATE + 100_000, UPDATE + 400_000)
    one = event(0.0, 0.0)
    met = [
        bool(is_uncertain(frames, dataclasses.replace(one, frame=np.array([k])))[0])
        for k in range(3)
    ]
    assert met == [True, True, False]
