"""Types of road users: sizes, antennas and bodies."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.replay.findings import Findings
from adapters.replay.xml_stream import Element, read_xml
from adapters.traffic.bodies import BODIES, Body, body_of
from adapters.traffic.geometry import Float
from orchestrator.suggestion import suggestion

_CAR: Final = (5.0, 1.8, 1.5)

CLASSES: Final[Mapping[str, tuple[float, float, float]]] = MappingProxyType(
    {
        **dict.fromkeys(
            ("passenger", "private", "authority", "army", "vip", "hov", "taxi", "evehicle"), _CAR
        ),
        **dict.fromkeys(("custom1", "custom2", "cable_car", "ignoring"), _CAR),
        "emergency": (6.5, 2.16, 2.86),
        "delivery": (6.5, 2.16, 2.86),
        "bus": (12.0, 2.5, 3.4),
        "coach": (14.0, 2.6, 4.0),
        "truck": (7.1, 2.4, 2.4),
        "trailer": (16.5, 2.55, 4.0),
        "tram": (22.0, 2.4, 3.2),
        "rail_urban": (109.5, 3.0, 3.6),
        "subway": (109.5, 3.0, 3.6),
        "rail": (135.0, 2.84, 3.75),
        "rail_electric": (200.0, 2.95, 3.89),
        "rail_fast": (200.0, 2.95, 3.89),
        "motorcycle": (2.2, 0.9, 1.5),
        "moped": (2.1, 0.78, 1.7),
        "bicycle": (1.6, 0.65, 1.7),
        "scooter": (1.2, 0.5, 1.7),
        "pedestrian": (0.215, 0.478, 1.719),
        "wheelchair": (1.2, 0.72, 1.2),
        "container": (6.096, 2.438, 2.591),
    }
)
"""Length, width and height [m] of SUMO's vehicle classes, as SUMO 1.28 has them.

SUMO's classes of ships, aircraft and drones are no road users.
"""

DEFAULT_TYPES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "DEFAULT_VEHTYPE": "passenger",
        "DEFAULT_TAXITYPE": "taxi",
        "DEFAULT_BIKETYPE": "bicycle",
        "DEFAULT_PEDTYPE": "pedestrian",
        "DEFAULT_CONTAINERTYPE": "container",
        "DEFAULT_RAILTYPE": "rail",
    }
)
"""The classes of the types that SUMO has without a declaration."""

_ROOTS: Final = frozenset({"additional", "routes"})
_SIZE: Final = ("length", "width", "height")


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """What all road users of a type have in common.

    Attributes:
        size: length, width and height [m].
        body: the shape.
        antenna_height: above the ground [m]; `None` if it follows the roof.
    """

    size: tuple[float, float, float]
    body: Body
    antenna_height: float | None = None

    @classmethod
    def of_class(cls, vehicle_class: str) -> "Kind":
        """What SUMO's vehicle class says."""
        size = CLASSES[vehicle_class]
        return cls(size=size, body=body_of(vehicle_class, size[2]))


class Kinds:
    """The types of a file, by name.

    A type is known if it is declared, is one of SUMO's own types, or is called like one of SUMO's
    vehicle classes. SUMO calls the type of a vehicle that was changed `<type>@<vehicle>`.

    Args:
        declared: those of a types file.
        antenna_above_roof: where a type does not say the height of its antenna [m].
    """

    def __init__(self, declared: Mapping[str, Kind], antenna_above_roof: float) -> None:
        own = {name: Kind.of_class(name) for name in CLASSES}
        own |= {name: Kind.of_class(of) for name, of in DEFAULT_TYPES.items()}
        self._kinds = {**own, **declared}
        self._above_roof = antenna_above_roof
        self._rows: dict[str, int] = {}
        self._size = np.zeros((0, 3))
        self._antenna = np.zeros(0)
        self._body = np.zeros(0, np.int32)

    def knows(self, name: str) -> bool:
        """Whether there is such a type."""
        return self._find(name) is not None

    def hint(self, name: str) -> str:
        """What to write instead of an unknown type."""
        close = difflib.get_close_matches(name, self._kinds, n=1)
        meant = f"did you mean `{close[0]}`? Or " if close else ""
        return (
            f"{meant}declare it in the file of `types_file`, for example "
            f'`<vType id="{name}" vClass="passenger"/>`'
        )

    def sizes(self, names: Sequence[str], size: Float) -> Float:
        """Length, width and height [m], shape (road user, 3).

        Args:
            names: of known types.
            size: what the file says, NaN where it is silent, shape (road user, 3).
        """
        rows = self._of(names)
        return np.where(np.isnan(size), self._size[rows], size)

    def antenna_heights(self, names: Sequence[str], height: Float) -> Float:
        """Heights of antennas above the ground [m], shape (road user,).

        Args:
            names: of known types.
            height: of the roofs [m], shape (road user,).
        """
        rows = self._of(names)
        antenna = self._antenna[rows]
        return np.where(np.isnan(antenna), height + self._above_roof, antenna)

    def bodies(self, names: Sequence[str]) -> npt.NDArray[np.int32]:
        """Codes of `vehicle.body`, shape (road user,), of known types."""
        rows = self._of(names)
        return self._body[rows]

    def _find(self, name: str) -> Kind | None:
        return self._kinds.get(name) or self._kinds.get(name.partition("@")[0])

    def _of(self, names: Sequence[str]) -> list[int]:
        """Rows in the arrays, which grow with every type that is seen first."""
        for name in names:
            if name not in self._rows:
                kind = self._find(name)
                assert kind is not None, name  # noqa: S101 - unknown types were refused before
                self._rows[name] = len(self._rows)
                antenna = np.nan if kind.antenna_height is None else kind.antenna_height
                self._size = np.concatenate([self._size, [kind.size]])
                self._antenna = np.append(self._antenna, antenna)
                self._body = np.append(self._body, np.int32(kind.body))
        rows = self._rows
        return [rows[name] for name in names]


def read_kinds(path: Path, findings: Findings) -> Mapping[str, Kind]:
    """The `<vType>` elements of a SUMO file with additional elements or routes, by name.

    What a type does not say has the default of its class; without a class it is a passenger car.
    `<param>` elements may have the keys `antenna_height` [m] and `body`.

    Args:
        path: of the file.
        findings: takes what is wrong with it.
    """
    reader = _TypeReader(findings)
    for _ in read_xml(path, findings, reader.start):
        pass
    return reader.kinds()


class _TypeReader:
    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._types: dict[str, Element] = {}
        self._params: dict[str, dict[str, Element]] = {}
        self._last = ""

    def start(self, element: Element) -> None:
        """Take the start of an element."""
        attributes, name = element.attributes, element.attributes.get("id", "")
        if not element.parent and element.tag not in _ROOTS:
            what = f"`<{element.tag}>` is no SUMO file of types, whose root is `<additional>`"
            self._findings.note(element.place, what)
        elif element.tag == "vType":
            if not name:
                self._findings.note(element.place, "`id` of this `<vType>` is missing")
            elif name in self._types:
                self._findings.note(element.place, f"type `{name}` is declared twice")
            self._last = name
            self._types[name] = element
            self._params[name] = {}
        elif element.tag == "param" and element.parent == "vType":
            self._params[self._last][attributes.get("key", "")] = element

    def kinds(self) -> Mapping[str, Kind]:
        """All types."""
        return {name: self._kind(name) for name in self._types}

    def _kind(self, name: str) -> Kind:
        element, params = self._types[name], self._params[name]
        vehicle_class = element.attributes.get("vClass", "passenger")
        if vehicle_class not in CLASSES:
            what = f"`vClass` is `{vehicle_class}`; {suggestion(vehicle_class, CLASSES)}"
            self._findings.note(element.place, what)
            vehicle_class = "passenger"
        default = CLASSES[vehicle_class]
        length, width, height = (
            self._positive(element, key, key, value)
            for key, value in zip(_SIZE, default, strict=True)
        )
        antenna = params.get("antenna_height")
        return Kind(
            size=(length, width, height),
            body=self._body(params, vehicle_class, height),
            antenna_height=(
                None if antenna is None else self._positive(antenna, "antenna_height", "value", 0.0)
            ),
        )

    def _body(self, params: Mapping[str, Element], vehicle_class: str, height: float) -> Body:
        element = params.get("body")
        if element is None:
            return body_of(vehicle_class, height)
        written = element.attributes.get("value", "")
        if written not in BODIES:
            what = f"`body` is `{written}`; {suggestion(written, BODIES)}"
            self._findings.note(element.place, what)
        return BODIES.get(written, Body.CAR)

    def _positive(self, element: Element, what: str, attribute: str, default: float) -> float:
        written = element.attributes.get(attribute)
        if written is None and attribute in _SIZE:
            return default
        try:
            value = float(written or "")
        except ValueError:
            value = 0.0
        if not 0.0 < value < np.inf:
            shown = "missing" if written is None else f"`{written}`"
            message = f"`{what}` is {shown}, a positive number of metres is needed"
            self._findings.note(element.place, message)
        return value
