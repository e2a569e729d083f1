r"""Where the plane of a run lies on the Earth: the projection that its SUMO net declares.

A net that was made of a map has `<location projParameter="+proj=utm +zone=32 ...">`:
its coordinates are those of the projection plus the offset. Transverse Mercator projections are
inverted with Krueger's series to the sixth power of the third flattening, after C. F. F. Karney,
"Transverse Mercator with an accuracy of a few nanometers", Journal of Geodesy 85 (2011), eqs.
(11), (15), (36).
"""

import gzip
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from lxml import etree

from orchestrator.signal import Array

_ELLIPSOIDS: Final = {
    "WGS84": (6_378_137.0, 298.257223563),
    "GRS80": (6_378_137.0, 298.257222101),
}
"""Equatorial radius [m] and reciprocal of the flattening."""

_UTM: Final = {"k": 0.9996, "x_0": 500_000.0, "y_0": 0.0}
_SOUTH: Final = 10_000_000.0

_FAR: Final = 100_000.0
_WHOLE: Final = 1000.0
"""A net farther away than the first [m] counts from its corner, rounded down to the second [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """From the plane of a run to degrees.

    Attributes:
        text: as the net declares it, for PROJ.
        offset: what is added to positions of the run to get those of the projection [m].
        central: the central meridian [deg].
        scale: on it.
        false: easting and northing that the projection adds [m].
        radius: of the equator [m].
        flattening: of the ellipsoid.
    """

    text: str
    offset: tuple[float, float]
    central: float
    scale: float
    false: tuple[float, float]
    radius: float
    flattening: float

    def degrees(self, points: Array) -> Array:
        """Longitude and latitude [deg], shape (point, 2), of points [m], shape (point, 2)."""
        x, y = (points + np.array(self.offset) - np.array(self.false)).T
        n = self.flattening / (2.0 - self.flattening)
        size = self.radius / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0 + n**6 / 256.0)
        xi, eta = y / (self.scale * size), x / (self.scale * size)
        xi_0, eta_0 = xi.copy(), eta.copy()
        for j, beta in enumerate(_beta(n), start=1):
            xi_0 -= beta * np.sin(2 * j * xi) * np.cosh(2 * j * eta)
            eta_0 -= beta * np.cos(2 * j * xi) * np.sinh(2 * j * eta)
        tau_0 = np.sin(xi_0) / np.hypot(np.sinh(eta_0), np.cos(xi_0))
        longitude = np.degrees(np.arctan2(np.sinh(eta_0), np.cos(xi_0))) + self.central
        latitude = np.degrees(np.arctan(_tangent(tau_0, self.flattening)))
        return np.column_stack([longitude, latitude])


def projection_of(manifest: Mapping[str, Any]) -> Projection | None:
    """The projection of the net of a run; `None` if there is none that is known here.

    Args:
        manifest: of the run. Its files are looked for where they were.
    """
    folder = Path(str(manifest.get("scenario_file", ""))).parent
    components = manifest.get("scenario", {}).get("components", {})
    for component, files in manifest.get("files", {}).items():
        parameters = components.get(component, {}).get("parameters") or {}
        for name in files:
            if str(name).endswith((".net.xml", ".net.xml.gz")):
                is_moved = "origin" in parameters
                found = read_location(
                    folder / str(name), parameters.get("origin"), is_moved=is_moved
                )
                if found is not None:
                    return found
    return None


def read_location(
    net: Path, origin: Mapping[str, Any] | None, *, is_moved: bool
) -> Projection | None:
    """The projection that a net declares, if it is a known one.

    Args:
        net: the file.
        origin: what positions of the run are relative to, `x` and `y`, if it was said.
        is_moved: whether positions are relative to the corner of a net that is far away, otherwise.
    """
    location = _location(net)
    if location is None:
        return None
    text = location.get("projParameter", "")
    said = dict(part.lstrip("+").partition("=")[::2] for part in text.split())
    constants = _constants(said)
    if constants is None:
        return None
    shift = [float(part) for part in location.get("netOffset", "0,0").split(",")]
    low_x, low_y, high_x, high_y = map(float, location.get("convBoundary", "0,0,0,0").split(","))
    if origin is not None:
        here = tuple(float(str(origin[axis]).split()[0]) for axis in "xy")
    elif is_moved and max(map(abs, (low_x, low_y, high_x, high_y))) > _FAR:
        here = tuple(math.floor(low / _WHOLE) * _WHOLE for low in (low_x, low_y))
    else:
        here = (0.0, 0.0)
    ellipsoid = said.get("ellps") or said.get("datum") or "WGS84"
    radius, reciprocal = _ELLIPSOIDS.get(ellipsoid, _ELLIPSOIDS["WGS84"])
    return Projection(
        text=text,
        offset=(here[0] - shift[0], here[1] - shift[1]),
        radius=radius,
        flattening=1.0 / reciprocal,
        **constants,
    )


def _constants(said: Mapping[str, str]) -> dict[str, Any] | None:
    """Central meridian, scale and false origin of a transverse Mercator projection."""
    if said.get("proj") == "utm" and "zone" in said:
        south = _SOUTH if "south" in said else 0.0
        central = 6.0 * int(said["zone"]) - 183.0
        return {"central": central, "scale": _UTM["k"], "false": (_UTM["x_0"], south)}
    if said.get("proj") == "tmerc" and float(said.get("lat_0", 0.0)) == 0.0:
        scale = float(said.get("k", said.get("k_0", 1.0)))
        false = (float(said.get("x_0", 0.0)), float(said.get("y_0", 0.0)))
        return {"central": float(said.get("lon_0", 0.0)), "scale": scale, "false": false}
    return None


def _location(net: Path) -> dict[str, str] | None:
    """What `<location>` says, which stands before all edges; `None` if there is none."""
    pack = gzip.open if net.name.endswith(".gz") else open
    try:
        with pack(net, "rb") as file:
            for _, element in etree.iterparse(file, events=("end",), tag=("location", "edge")):
                return dict(element.attrib) if element.tag == "location" else None
    except (OSError, etree.XMLSyntaxError):
        pass
    return None


def _beta(n: float) -> tuple[float, ...]:
    """The coefficients of the inverse series, Karney's eq. (36)."""
    return (
        n / 2
        - 2 * n**2 / 3
        + 37 * n**3 / 96
        - n**4 / 360
        - 81 * n**5 / 512
        + 96199 * n**6 / 604800,
        n**2 / 48 + n**3 / 15 - 437 * n**4 / 1440 + 46 * n**5 / 105 - 1118711 * n**6 / 3870720,
        17 * n**3 / 480 - 37 * n**4 / 840 - 209 * n**5 / 4480 + 5569 * n**6 / 90720,
        4397 * n**4 / 161280 - 11 * n**5 / 504 - 830251 * n**6 / 7257600,
        4583 * n**5 / 161280 - 108847 * n**6 / 3991680,
        20648693 * n**6 / 638668800,
    )


def _tangent(conformal: Array, flattening: float) -> Array:
    """The tangent of the latitude for that of the conformal latitude, by Newton's method."""
    e = math.sqrt(flattening * (2.0 - flattening))
    tau = conformal.copy()
    for _ in range(5):
        sigma = np.sinh(e * np.arctanh(e * tau / np.hypot(1.0, tau)))
        tau_0 = tau * np.hypot(1.0, sigma) - sigma * np.hypot(1.0, tau)
        slope = (1.0 + (1.0 - e**2) * tau**2) / ((1.0 - e**2) * np.hypot(1.0, tau))
        tau += (conformal - tau_0) / np.hypot(1.0, tau_0) * slope
    return tau
