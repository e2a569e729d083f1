"""SUMO's floating car data: who was where, and what its type is.

https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html has the format. Angles are degrees
clockwise from north, positions the middle of the front bumper.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Final, TextIO
from xml.sax.saxutils import quoteattr

import numpy as np

from adapters.traffic.bodies import Body
from adapters.traffic.geometry import direction
from orchestrator.recording.tidy import Lost
from orchestrator.signal import Array
from studies.exports.export import Asked, Exported, Format
from studies.exports.geo import Projection, projection_of
from studies.exports.outputs import ExportError
from studies.exports.scene import Snapshot, Users, users_of

_CLASSES: Final = {
    Body.CAR: "passenger",
    Body.SUV: "passenger",
    Body.VAN: "delivery",
    Body.BUS: "bus",
    Body.TRUCK: "truck",
    Body.RAIL: "tram",
    Body.MOTORCYCLE: "motorcycle",
    Body.BICYCLE: "bicycle",
    Body.PEDESTRIAN: "pedestrian",
}
"""SUMO's vehicle class of each body."""

TRAFFIC: Final = "traffic.fcd.xml"
TYPES: Final = "types.add.xml"


def write(asked: Asked, draft: Path) -> Exported:
    """Write a folder with who was where, and the types.

    Args:
        asked: of which run.
        draft: the folder, which is created.

    Raises:
        ExportError: no road users are recorded; or there is no projection, and one was asked for.
    """
    users, left_out = users_of(asked.recording)
    projection = projection_of(asked.manifest) if asked.is_geographic else None
    if asked.is_geographic and projection is None:
        raise ExportError(
            "--geo: no net of this run has a projection (`projParameter` of its `<location>`), or "
            "none of its files is where it was; leave --geo out"
        )
    draft.mkdir()
    lost, types = Lost.nothing(), _Types(users)
    with (draft / TRAFFIC).open("w", encoding="utf-8") as file:
        counted = _write_traffic(file, users, types, projection, lost)
    with (draft / TYPES).open("w", encoding="utf-8") as file:
        file.writelines(types.lines())
    if counted.bodiless:
        noun = "roadside unit is" if counted.bodiless == 1 else "roadside units are"
        left_out.append(f"{counted.bodiless} {noun} left out: FCD has no element for it")
    return Exported(
        files={
            TRAFFIC: f"{counted.samples} samples at {counted.times} times",
            TYPES: f"{len(types)} type{'s' if len(types) != 1 else ''}",
        },
        left_out=(*left_out, *lost.said),
    )


class _Counted:
    """How much was written."""

    def __init__(self) -> None:
        self.times = 0
        self.samples = 0
        self._bodiless: set[int] = set()

    @property
    def bodiless(self) -> int:
        return len(self._bodiless)

    def add(self, snapshot: Snapshot) -> None:
        self.times += 1
        is_body = snapshot.is_body
        self.samples += int(is_body.sum())
        self._bodiless.update(snapshot.ids[~is_body].tolist())


def _write_traffic(
    file: TextIO, users: Users, types: "_Types", projection: Projection | None, lost: Lost
) -> _Counted:
    counted = _Counted()
    file.write('<?xml version="1.0" encoding="UTF-8"?>\n<fcd-export>\n')
    for snapshot in users.snapshots(lost):
        counted.add(snapshot)
        file.write(f'    <timestep time="{_seconds(snapshot.time)}">\n')
        file.writelines(_elements(snapshot.those(snapshot.is_body), users, types, projection))
        file.write("    </timestep>\n")
    file.write("</fcd-export>\n")
    return counted


def _elements(
    snapshot: Snapshot, users: Users, types: "_Types", projection: Projection | None
) -> Iterator[str]:
    """Vehicles, then persons, as the schema of SUMO wants them."""
    front = snapshot.position[:, :2] + 0.5 * snapshot.size[:, :1] * direction(snapshot.heading)
    if projection is None:
        places = [f'x="{x:.6f}" y="{y:.6f}"' for x, y in front.tolist()]
    else:
        places = [f'x="{x:.9f}" y="{y:.9f}"' for x, y in projection.degrees(front).tolist()]
    angle = (90.0 - np.degrees(snapshot.heading)) % 360.0
    speed = np.hypot(*snapshot.velocity.T)
    on_foot = snapshot.body == Body.PEDESTRIAN
    for tag, which in (("vehicle", ~on_foot), ("person", on_foot)):
        for k in np.flatnonzero(which).tolist():
            number = int(snapshot.ids[k])
            kind = types.of(number, snapshot.size[k], int(snapshot.body[k]))
            height = float(snapshot.position[k, 2])
            z = f' z="{height:.6f}"' if height else ""
            yield (
                f"        <{tag} id={quoteattr(users.name_of(number))} {places[k]}{z} "
                f'angle="{_plain(angle[k])}" type={quoteattr(kind)} speed="{_plain(speed[k])}"/>\n'
            )


class _Types:
    """The types of who was there; one whose size differs is a type of its own, as in SUMO."""

    def __init__(self, users: Users) -> None:
        self._users = users
        self._found: dict[str, tuple[tuple[float, ...], int]] = {}
        self._of: dict[tuple[int, tuple[float, ...]], str] = {}

    def __len__(self) -> int:
        return len(self._found)

    def of(self, number: int, size: Array, body: int) -> str:
        """The name of the type of a road user of a size [m], shape (3,)."""
        measures = tuple(size.tolist())
        known = self._of.get((number, measures))
        if known is not None:
            return known
        named = self._users.named.get(number)
        name = named.type if named is not None else _CLASSES[Body(body)]
        if self._found.setdefault(name, (measures, body)) != (measures, body):
            name = f"{name}@{self._users.name_of(number)}"
            self._found.setdefault(name, (measures, body))
        self._of[number, measures] = name
        return name

    def lines(self) -> Iterator[str]:
        """A file of additional elements for SUMO."""
        yield '<?xml version="1.0" encoding="UTF-8"?>\n<additional>\n'
        for name, ((length, width, height), body) in sorted(self._found.items()):
            yield (
                f'    <vType id={quoteattr(name)} vClass="{_CLASSES[Body(body)]}" '
                f'length="{_plain(length)}" width="{_plain(width)}" height="{_plain(height)}">'
                f'<param key="body" value="{Body(body).name.lower()}"/></vType>\n'
            )
        yield "</additional>\n"


def _seconds(time: int) -> str:
    """A time [ns] in seconds, exactly, with two decimals or as many as it needs."""
    whole, rest = divmod(time, 10**9)
    decimals = f"{rest:09d}".rstrip("0")
    return f"{whole}.{decimals:0<2}"


def _plain(number: float) -> str:
    return f"{number:.6f}"


FORMATS: Final = {"fcd": Format("fcd", write)}
