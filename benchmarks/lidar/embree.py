"""The peer: Embree 4 through embreex, in two scenes, what stands and what drives."""

from dataclasses import dataclass
from importlib.metadata import version
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.lidar.caster import Caster, Hits, Prism
from benchmarks.lidar.mesh import mesh
from benchmarks.lidar.pattern import Pattern, sensor_position
from benchmarks.lidar.town import Town
from fmus.messages.records import GROUND
from orchestrator.errors import CosimError

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:
    EmbreeScene = None

Single = npt.NDArray[np.float32]
Int = npt.NDArray[np.int64]

_GROUND_SIDE: Final = 4000.0
"""The side of the square that stands for the ground [m]."""

_NOTHING: Final = 0


class MissingPeerError(CosimError):
    """Embree is not installed. Exit code 2."""


def is_embree_installed() -> bool:
    """Whether the peer is there."""
    return EmbreeScene is not None


def require_embree() -> None:
    """Say so if the peer is not installed.

    Raises:
        MissingPeerError: it is not.
    """
    if not is_embree_installed():
        raise MissingPeerError(
            "the lidar is measured beside Embree, and embreex is not installed: "
            "`pip install 'nlosim[bench]'`"
        )


def embree_version() -> str:
    """The version of the Python package, which carries the library."""
    return f"embreex {version('embreex')}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Rays:
    """Attributes: origin and direction of each ray of a scan, float32, shape (ray, 3)."""

    origin: Single
    direction: Single


class Embree:
    """One scan after the other. Triangles and rays are prepared beforehand.

    The scene of what drives is made anew for each scan, since all of it has moved, and since Embree
    as embreex offers it cannot move what it has. Rays begin in the scene of what stands, and go on
    in the other as far as they came.
    """

    def __init__(self, town: Town, pattern: Pattern) -> None:
        require_embree()
        self._reach = np.float32(pattern.reach)
        caster = Caster(town, pattern)
        scans = range(len(town.position))
        prisms = [_shown(caster, scan) for scan in scans]
        caster.close()
        standing, self._standing_instance = mesh(p for p in prisms[0] if p.instance < 0)
        ground = _ground()
        self._standing_instance = np.append([GROUND] * len(ground), self._standing_instance)
        self._standing = _scene(np.concatenate([ground, standing]).astype(np.float32))
        driving = [mesh(p for p in shown if p.instance >= 0) for shown in prisms]
        self._driving_triangles = [found.astype(np.float32) for found, _ in driving]
        self._driving_instance = [name for _, name in driving]
        self._rays = [[_rays(town, pattern, scan, v) for v in town.sensors] for scan in scans]
        self._driving: Any = None
        self._found: tuple[Any, Any] = ({}, {})
        self._standing.run(self._rays[0][0].origin[:1], self._rays[0][0].direction[:1])  # commits

    def show(self, scan: int) -> None:
        """Make the scene of what drives; it is built when the first ray comes."""
        self._driving = _scene(self._driving_triangles[scan])

    def cast(self, scan: int, sensor: int) -> None:
        """Trace all rays of one sensor, in the scene that is shown."""
        rays = self._rays[scan][sensor]
        reach = np.full(len(rays.origin), self._reach)
        standing = self._standing.run(rays.origin, rays.direction, dists=reach, output=1)
        driving = self._driving.run(rays.origin, rays.direction, dists=standing["tfar"], output=1)
        self._found = standing, driving

    def hits(self, scan: int) -> Hits:
        """What the last scan hit."""
        standing, driving = self._found
        instance = np.full(len(driving["tfar"]), _NOTHING)
        for found, names in (
            (standing, self._standing_instance),
            (driving, self._driving_instance[scan]),
        ):
            is_hit = found["primID"] >= 0
            instance[is_hit] = names[found["primID"][is_hit]]
        is_hit = (standing["primID"] >= 0) | (driving["primID"] >= 0)
        distance = np.where(is_hit, driving["tfar"].astype(np.float64), np.inf)
        return Hits(distance=distance, instance=instance.astype(np.int32))


def _shown(caster: Caster, scan: int) -> list[Prism]:
    caster.show(scan)
    return list(caster.prisms())


def _scene(triangles: Single) -> Any:
    """Not `robust`: that is faster, and misses no more than single rays at edges."""
    scene = EmbreeScene(robust=False)
    TriangleMesh(scene, triangles)
    return scene


def _ground() -> npt.NDArray[np.float64]:
    a = _GROUND_SIDE / 2
    p, q, r, s = (-a, -a, 0.0), (a, -a, 0.0), (a, a, 0.0), (-a, a, 0.0)
    return np.array([(p, q, r), (p, r, s)])


def _rays(town: Town, pattern: Pattern, scan: int, vehicle: int) -> _Rays:
    direction = pattern.directions(float(town.heading[scan, vehicle])).astype(np.float32)
    origin = np.tile(sensor_position(town, scan, vehicle).astype(np.float32), (pattern.rays, 1))
    return _Rays(origin=origin, direction=direction)
