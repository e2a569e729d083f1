"""Traces of ASAM OSI: one file of GroundTruth, and one of SensorView for each lidar.

A trace is a sequence of messages, each after its length as a u32; the names of the files are those
of OSI's convention, `TIMESTAMP_TYPE_OSI_PROTOBUF_FRAMES_NAME.osi`.
"""

import re
import struct
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

from fmus.messages.records import POINTS_MIME
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Series
from orchestrator.recording.tidy import Lost
from studies.exports.export import Asked, Exported, Format, module_for
from studies.exports.geo import projection_of
from studies.exports.osi_messages import EXTRA, SUBJECT, World
from studies.exports.scene import binary_signals, driven_in, surroundings_of, users_of
from studies.exports.show import clouds

_LENGTH: Final = struct.Struct("<I")
_UNKNOWN: Final = "19700101T000000Z"


class _Trace:
    """A file that messages are appended to."""

    def __init__(self, path: Path, stack: ExitStack) -> None:
        self.path = path
        self.frames = 0
        self._file: BinaryIO = stack.enter_context(path.open("wb"))

    def append(self, message: Any) -> None:
        data = message.SerializeToString()
        self._file.write(_LENGTH.pack(len(data)) + data)
        self.frames += 1


def write(asked: Asked, draft: Path) -> Exported:
    """Write a folder of traces.

    Args:
        asked: of which run.
        draft: the folder, which is created.

    Raises:
        ExportError: no road users are recorded.
    """
    recording = asked.recording
    manifest = _manifest(asked)
    users, left_out = users_of(recording)
    surroundings = surroundings_of(recording)
    world = World(users, surroundings, projection_of(manifest))
    hosts = list(driven_in(recording).values())
    lost = Lost.nothing()
    scans: list[Series] = []
    for name in binary_signals(recording, POINTS_MIME):
        try:
            scans.append(recording[name])
        except RecordingError as error:
            left_out.append(f"`{name}` is left out: {error}")
    if not scans:
        left_out.append("no points of lidars are recorded: there are no SensorViews")
    draft.mkdir()
    views: dict[int, _Trace] = {}
    with ExitStack() as stack:
        truths = _Trace(draft / "gt", stack)
        for snapshot in users.snapshots(lost):
            truth = world.truth(snapshot, _host(hosts, snapshot.time))
            truths.append(truth)
            for series in scans:
                for sensor, points in _scan(series, snapshot.time, lost):
                    view = world.view(sensor, points, truth, snapshot)
                    if view is not None:
                        number = int(sensor["vehicle"])
                        if number not in views:
                            views[number] = _Trace(draft / f"sv-{number}", stack)
                        views[number].append(view)
    files = dict([_renamed(truths, "gt", asked.name, manifest, world)])
    for number, trace in sorted(views.items()):
        name = f"{asked.name}-{users.name_of(number)}"
        files.update([_renamed(trace, "sv", name, manifest, world)])
    return Exported(files=files, left_out=(*left_out, *surroundings.left_out, *lost.said))


def _host(driven: list[Series], time: int) -> int | None:
    """The number of the first driven entity that is there."""
    for series in driven:
        try:
            number = int(np.asarray(series.at(time)))
        except RecordingError:
            continue
        if number >= 0:
            return number
    return None


def _scan(series: Series, time: int, lost: Lost) -> list[tuple[Any, Any]]:
    """What the lidars tell at `time` [ns], if they tell anything then."""
    k = int(np.searchsorted(series.times, time))
    if k == len(series) or series.times[k] != time:
        return []
    try:
        return clouds(bytes(series[k]))
    except RecordingError as error:
        lost.note(series.name, time, error)
    except ValueError as error:
        lost.note(series.name, time, RecordingError(str(error)))
    return []


def _manifest(asked: Asked) -> dict[str, Any]:
    try:
        return asked.manifest
    except RecordingError:
        return {}


def _renamed(
    trace: _Trace, kind: str, name: str, manifest: Mapping[str, Any], world: World
) -> tuple[str, str]:
    """Give a trace the name of OSI's convention; that name, and what is in it."""
    digits = re.sub(r"[-:]|\+.*", "", str(manifest.get("created", "")))
    created = f"{digits}Z" if digits else _UNKNOWN
    protobuf = module_for("google.protobuf", SUBJECT, EXTRA).__version__.replace(".", "")
    osi = "".join(map(str, world.interface))
    custom = re.sub(r"[^A-Za-z0-9.-]+", "-", name)
    final = f"{created}_{kind}_{osi}_{protobuf}_{trace.frames}_{custom}.osi"
    trace.path.replace(trace.path.with_name(final))
    what = "GroundTruth" if kind == "gt" else "SensorView"
    return final, f"{trace.frames} x {what}"


def _check() -> None:
    module_for("osi3.osi_groundtruth_pb2", SUBJECT, EXTRA)


FORMATS: Final = {"osi": Format("osi", write, _check)}
