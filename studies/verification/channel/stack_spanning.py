"""Frames on air while the positions change.

The channel, as Veins, takes the losses of a frame at its start. But Veins puts off what it does not
need: once path loss and buildings have brought a frame below the sensitivity, the vehicles in
between are looked at only when somebody asks for the exact power: another frame that is being
decoded, or, at the frame's end, the recorder of these data. If positions have been updated by then,
Veins uses the new positions of the bodies, but the old ones of the two antennas.

That is no property of a radio channel, and the channel does not copy it. The golden power of such a
frame may be what the channel says of the link at the frame's start, or of a link between the same
antennas among the new bodies, whichever is nearer. The lowest SNIR of frames that are on air during
an update, or overlap one that is, is not compared.
"""

import numpy as np

from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_matching import Pairs
from studies.verification.channel.stack_run import StackRun


def spanning(run: StackRun) -> Array:
    """Indices of frames that end after an update of the positions that follows their start."""
    frames = run.frames
    last = run.updates_at(frames.start + frames.duration)
    return np.flatnonzero(last != run.updates_at(frames.start))


def late_powers(channel: ChannelUnderTest, run: StackRun, pairs: Pairs) -> Array:
    """Our powers as Veins records them, shape (event,): `pairs.power`, but for the case above."""
    power: Array = pairs.power[:, 1].copy()
    if not run.parameters.channel["vehicle_shadowing"]:
        return power
    for frame in spanning(run):
        rows = np.flatnonzero(pairs.frame == frame)
        if len(rows):
            early, late = _powers(channel, run, int(frame), pairs.receiver[rows])
            is_weak = early < run.parameters.channel["sensitivity"]
            golden, ours = pairs.power[rows].T
            is_nearer = np.abs(late - golden) < np.abs(ours - golden)
            power[rows] = np.where(is_weak & is_nearer, late, ours)
    return power


def _powers(
    channel: ChannelUnderTest, run: StackRun, frame: int, receivers: Array
) -> tuple[Array, Array]:
    """Without any vehicles in between, and with those of the next update, shape (receiver,)."""
    update = int(run.updates_at(run.frames.start[[frame]])[0])
    bodies = run.updates[update + 1].vehicles
    antennas = run.antennas(np.full(len(receivers), update), receivers)
    carriers = np.stack([np.full(len(receivers), run.frames.vehicle[frame]), receivers], axis=-1)
    carriers[~np.isin(carriers, bodies["vehicle.id"])] = NO_VEHICLE  # it has left
    transmitters = np.broadcast_to(run.frames.antenna[frame], antennas.shape)
    probes = scene.links(transmitters, antennas, carriers)
    inputs = {**bodies, **scene.buildings(run.rings), **probes}
    with channel.start(run.parameters.channel, inputs) as session:
        early = run.parameters.channel["transmit_power"] - session.probed("path_loss")
        if run.parameters.channel["building_shadowing"]:
            early = early - session.probed("building_loss")
        return early, early - session.probed("vehicle_loss")


def is_uncertain(run: StackRun, pairs: Pairs) -> Array:
    """Whether Veins may have weighed interferers of the event after an update, shape (event,)."""
    frames = run.frames
    start, end = frames.start, frames.start + frames.duration
    uncertain = np.zeros(len(start), np.bool_)
    for frame in spanning(run):
        uncertain |= (start <= end[frame]) & (end >= start[frame])
    found: Array = uncertain[pairs.frame]
    return found
