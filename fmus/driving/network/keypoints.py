"""Keypoints: what an encoder makes of a scan."""

from dataclasses import dataclass

from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Keypoints:
    """Keypoints by falling importance, in the frame of their sensor.

    Attributes:
        x, y: ahead and left [m], shape (keypoint,).
        z: over the ground [m], shape (keypoint,).
        features: shape (keypoint, features).
    """

    x: Array
    y: Array
    z: Array
    features: Array
