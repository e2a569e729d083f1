"""Where road users are between two samples."""

from typing import Literal, TypeAlias

import numpy as np

from adapters.replay.tracks import Tracks
from adapters.traffic.geometry import wrap
from orchestrator.timebase import Time

Interpolation: TypeAlias = Literal["linear", "hold"]


def between(last: Tracks, following: Tracks, time: Time, interpolation: Interpolation) -> Tracks:
    """The state of road users at a time; sizes and what they carry are those of the last samples.

    Args:
        last: the last samples at or before `time`, shape (road user,).
        following: the next samples of the same, or the last again, shape (road user,).
        time: of the file [ns].
        interpolation: `linear` in position, speed, and heading on the shorter arc; or `hold`.

    Returns:
        Shape (road user,).
    """
    state = last.copy()
    if interpolation == "hold":
        return state
    span = following["time"] - last["time"]
    weight = (time - last["time"]) / np.maximum(span, 1)
    state["center"] += weight[:, None] * (following["center"] - last["center"])
    state["speed"] += weight * (following["speed"] - last["speed"])
    turned = last["heading"] + weight * wrap(following["heading"] - last["heading"])
    state["heading"] = np.where(weight > 0.0, wrap(turned), last["heading"])
    return state
