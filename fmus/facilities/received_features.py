"""The keypoints that reached the ego: of the newest scans of each source, while they are fresh."""

from dataclasses import dataclass, replace
from typing import Final

from fmus.facilities.held import HeldSignal
from fmus.messages.features import FeaturesMessage, write_features
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

_NOTHING: Final = write_features([])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Scan:
    """Which keypoints arrived, bool of shape (keypoint,), and the message with these only."""

    arrived: Array
    message: FeaturesMessage


class ReceivedFeatures:
    """Keypoints by source and scan.

    Scans are told apart, ordered and forgotten by the time of the scan, not of its arrival.

    Args:
        maximum_age: of a scan when it is forgotten [ns].
        scans: most scans of one source that are known: the newest.
    """

    def __init__(self, maximum_age: Duration, scans: int) -> None:
        self._maximum_age = maximum_age
        self._most = scans
        self._scans: dict[int, dict[Time, _Scan]] = {}
        self._signal = HeldSignal(write_features)

    def add(self, features: FeaturesMessage, arrived: Array) -> None:
        """Take in keypoints beside those of the same scan that arrived before.

        Args:
            features: those of the scan, as sent.
            arrived: which of its keypoints are there, bool, shape (keypoint,).
        """
        scans = self._scans.setdefault(features.vehicle, {})
        known = scans.get(features.time)
        if known is not None:
            arrived = arrived | known.arrived
            if (arrived == known.arrived).all():
                return
        keypoints = features.keypoints.compress(arrived, axis=0)
        message = features if arrived.all() else replace(features, keypoints=keypoints)
        scans[features.time] = _Scan(arrived=arrived, message=message)

    def output(self, now: Time) -> bytes:
        """The connector `received.features` at `now`, by ascending (source, time of the scan)."""
        if not self._scans:
            return _NOTHING
        self._scans = {
            source: kept
            for source, scans in sorted(self._scans.items())
            if (kept := self._kept(scans, now))
        }
        return self._signal.of(
            [scan.message for scans in self._scans.values() for scan in scans.values()]
        )

    def _kept(self, scans: dict[Time, _Scan], now: Time) -> dict[Time, _Scan]:
        newest = sorted(scans)[-self._most :]
        return {time: scans[time] for time in newest if now - time <= self._maximum_age}
