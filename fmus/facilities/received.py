"""What the ego knows from messages that arrived, while it is fresh."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmus.facilities.held import HeldSignal
from fmus.facilities.received_features import ReceivedFeatures
from fmus.messages.apm import join, shifted
from fmus.messages.features import FeaturesMessage
from fmus.messages.records import OBJECT, frame
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time


def _in_step(_: int) -> Duration:
    """No clock is ahead of another."""
    return 0


class Received:
    """The newest APM, objects and features of each source; held, so that slow readers miss none.

    Times in messages are of the source's clock. So they are off by what that clock is ahead of the
    ego's, and what is too old to be known is judged by them.

    Args:
        maximum_age: when things are forgotten [ns].
        scans: most scans of one source whose features are known.
        lead: how far the clock of a source is ahead of the ego's [ns], constant.
    """

    def __init__(
        self,
        maximum_age: Duration,
        scans: int = 1,
        lead: Callable[[int], Duration] = _in_step,
    ) -> None:
        self._maximum_age = maximum_age
        self._lead = lead
        self._features = ReceivedFeatures(maximum_age, scans)
        self._apms: dict[int, tuple[Time, bytes]] = {}
        self._objects: dict[int, Array] = {}
        self._scans: dict[int, Time] = {}
        self._apms_signal = HeldSignal(join)
        self._objects_signal = HeldSignal(_objects_frame)

    def keep_apm(self, source: int, time: Time, apm: bytes) -> None:
        """`apm` was sent at `time` [ns]."""
        lead = self._lead(source)
        self._apms[source] = (time + lead, shifted(apm, lead) if lead else apm)

    def replace_objects(self, source: int, time: Time, objects: Array) -> None:
        """Forget what a source told before; what overtook a newer message changes nothing.

        Args:
            source: a vehicle.
            time: of its message [ns].
            objects: all that the message tells, `OBJECT` records of shape (object,).
        """
        if time > self._scans.get(source, time - 1):
            self._scans[source] = time
            self._objects[source] = self._stamped(source, objects)

    def update_objects(self, source: int, objects: Array) -> None:
        """Take in some of the objects that a source sees; of each the newest record is kept.

        Args:
            source: a vehicle.
            objects: `OBJECT` records of shape (object,).
        """
        known = self._objects.get(source)
        stamped = self._stamped(source, objects)
        rows = stamped if known is None else np.concatenate([known, stamped])
        by_time = rows[np.argsort(rows["time"], kind="stable")]
        newest = {int(row["instance"]): row for row in by_time}
        self._objects[source] = np.array([newest[number] for number in sorted(newest)], OBJECT)

    def add_keypoints(self, features: FeaturesMessage, arrived: Array) -> None:
        """Take in keypoints of a scan.

        Args:
            features: those of the scan, as sent.
            arrived: which of its keypoints are there, bool, shape (keypoint,).
        """
        lead = self._lead(features.vehicle)
        stamped = replace(features, time=features.time + lead) if lead else features
        self._features.add(stamped, arrived)

    def outputs(self, now: Time) -> Mapping[str, bytes]:
        """The connectors `received.apms`, `.objects` and `.features` at `now`, by source."""
        self._apms = {
            source: (time, apm)
            for source, (time, apm) in self._apms.items()
            if now - time <= self._maximum_age
        }
        fresh = {source: self._fresh(table, now) for source, table in self._objects.items()}
        self._objects = {source: table for source, table in fresh.items() if len(table)}
        return {
            "received.apms": self._apms_signal.of(
                [apm for _, (_, apm) in sorted(self._apms.items())]
            ),
            "received.objects": self._objects_signal.of(
                [self._objects[source] for source in sorted(self._objects)]
            ),
            "received.features": self._features.output(now),
        }

    def _stamped(self, source: int, objects: Array) -> Array:
        """`objects` at the times that the clock of `source` said."""
        lead = self._lead(source)
        if not lead:
            return objects
        stamped = objects.copy()
        stamped["time"] += lead
        return stamped

    def _fresh(self, table: Array, now: Time) -> Array:
        young = now - table["time"] <= self._maximum_age
        return table if young.all() else table[young]


def _objects_frame(tables: Sequence[Array]) -> bytes:
    return frame("OBJS", np.concatenate(tables) if tables else np.empty(0, OBJECT))
