"""From a file to bodies on the road, time by time, with every fault that is found."""

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from adapters.replay.degrees import Degrees
from adapters.replay.fcd import read_fcd
from adapters.replay.files import kind_of
from adapters.replay.findings import Findings, TrafficFileError
from adapters.replay.kinds import Kinds
from adapters.replay.snapshot import Snapshot
from adapters.replay.table import PARQUET, read_csv, read_parquet
from adapters.traffic.geometry import Float, direction, wrap
from orchestrator.timebase import Time, seconds

Heading: TypeAlias = Literal["math-deg", "compass-deg", "math-rad"]
Reference: TypeAlias = Literal["centre", "front"]
Read: TypeAlias = Callable[[Path, Findings], Iterator[Snapshot]]

MOST_SAMPLES: Final = 100_000
"""Samples, of one road user at one time each, that are looked at for faults at once."""

_FCD: Final = ".xml"
_FORMATS: Final[Mapping[str, Read]] = MappingProxyType(
    {_FCD: read_fcd, ".csv": read_csv, PARQUET: read_parquet}
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """All road users at one time.

    Attributes:
        time: of the file [ns].
        names: the file's ids.
        keys: as of `Snapshot`.
        types: their names.
        center: of the bodies [m], shape (road user, 2).
        heading: counter-clockwise from east [rad], in [-pi, pi), shape (road user,).
        speed: along the heading [m/s], shape (road user,).
        size: length, width, height [m], shape (road user, 3).
        antenna_height: above the ground [m], shape (road user,).
        body: codes of `vehicle.body`, shape (road user,).
    """

    time: Time
    names: tuple[str, ...]
    keys: tuple[str, ...]
    types: tuple[str, ...]
    center: Float
    heading: Float
    speed: Float
    size: Float
    antenna_height: Float
    body: npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """How a file writes positions and directions.

    Attributes:
        heading: `math-deg`, `math-rad` count counter-clockwise from east, `compass-deg`
            clockwise from north.
        reference: which point of the body x and y are: its centre, or the middle of its front.
    """

    heading: Heading
    reference: Reference

    def headings(self, written: Float) -> Float:
        """Headings counter-clockwise from east [rad], in [-pi, pi), of the shape of `written`."""
        if self.heading == "math-rad":
            return wrap(written)
        degrees = 90.0 - written if self.heading == "compass-deg" else written
        return wrap(np.radians(degrees))

    def centers(self, written: Float, heading: Float, length: Float) -> Float:
        """Centres of bodies [m].

        Args:
            written: x and y [m], shape (road user, 2).
            heading: counter-clockwise from east [rad], shape (road user,).
            length: of the bodies [m], shape (road user,).

        Returns:
            Shape (road user, 2).
        """
        if self.reference == "centre":
            return written
        return written - 0.5 * length[:, None] * direction(heading)


_OF_SUMO: Final = Convention(heading="compass-deg", reference="front")


class Source:
    """A file of traffic.

    Args:
        path: of the file; its name tells the format.
        kinds: the types.
        convention: of tables; SUMO's own files have SUMO's.

    Raises:
        TrafficFileError: the name tells no format.
    """

    def __init__(self, path: Path, kinds: Kinds, convention: Convention) -> None:
        format_ = kind_of(path)
        if format_ not in _FORMATS:
            raise TrafficFileError(
                f"`file`: `{path.name}` is of no known format; *.xml (SUMO's FCD output), *.csv, "
                "both also as *.gz, and *.parquet are"
            )
        self._path = path
        self._read = _FORMATS[format_]
        self._kinds = kinds
        self._convention = _OF_SUMO if format_ == _FCD else convention

    def frames(self) -> Generator[Frame, None, None]:
        """The file from its begin on, read as far as it is asked for.

        Raises:
            TrafficFileError: the file is wrong; so far as one can tell from the next
                `MOST_SAMPLES` samples, all that is wrong.
            ComponentTypeError: a library that this format needs is not installed.
        """
        findings = Findings(self._path)
        degrees = Degrees()
        before: Time | None = None
        samples_since = 0
        for snapshot in self._read(self._path, findings):
            if before is not None and snapshot.time <= before:
                what = (
                    f"time {seconds(snapshot.time):.9g} s comes after {seconds(before):.9g} s; "
                    "the file must be sorted by time"
                )
                findings.note(snapshot.place, what)
            before = snapshot.time if before is None else max(before, snapshot.time)
            self._check_types(snapshot, findings)
            if not findings:
                degrees.take(snapshot, findings)
            if not findings:
                yield self._frame(snapshot)
                continue
            samples_since += len(snapshot.names)
            if samples_since >= MOST_SAMPLES:
                break
        degrees.tell(findings)
        if not findings and before is None:
            findings.note((1, 1), "there is no sample in this file")
        if findings:
            raise TrafficFileError("\n".join(findings.lines(self._kinds.hint)))

    def _check_types(self, snapshot: Snapshot, findings: Findings) -> None:
        unknown = {kind for kind in set(snapshot.types) if kind and not self._kinds.knows(kind)}
        if unknown:
            for kind, name, place in zip(
                snapshot.types, snapshot.names, snapshot.places, strict=True
            ):
                if kind in unknown:
                    findings.note_type(kind, name, place)

    def _frame(self, snapshot: Snapshot) -> Frame:
        types, motion = snapshot.types, snapshot.motion
        heading = self._convention.headings(motion[:, 2])
        size = self._kinds.sizes(types, snapshot.size)
        return Frame(
            time=snapshot.time,
            names=tuple(snapshot.names),
            keys=tuple(snapshot.keys),
            types=tuple(types),
            center=self._convention.centers(motion[:, :2], heading, size[:, 0]),
            heading=heading,
            speed=motion[:, 3],
            size=size,
            antenna_height=self._kinds.antenna_heights(types, size[:, 2]),
            body=self._kinds.bodies(types),
        )
