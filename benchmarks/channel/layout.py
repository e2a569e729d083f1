"""Where vehicles are over time, and what stands around them."""

import importlib.resources
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from orchestrator.signal import Array

Float = npt.NDArray[np.float64]

DATA: Final = Path(str(importlib.resources.files("benchmarks") / "data" / "channel"))
"""Written by `benchmarks.channel.import_golden`."""

_MILLIMETRE: Final = 1e-3
_MICRODEGREE: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """Vehicles on streets among buildings, sampled every 0.1 s.

    Attributes:
        front: centre of the front bumper [m], shape (scene, vehicle, 2); x east, y north.
        heading: counter-clockwise from east [rad], shape (scene, vehicle).
        size: length, width and height of each vehicle [m], shape (vehicle, 3).
        vertex: corners of all buildings, ring by ring [m], shape (corner, 2).
        index: the building of each corner, shape (corner,).
    """

    front: Float
    heading: Float
    size: Float
    vertex: Float
    index: npt.NDArray[np.int32]

    @property
    def scenes(self) -> int:
        """How many scenes there are."""
        return len(self.front)

    @property
    def vehicles(self) -> int:
        """How many vehicles there are in each of them."""
        return len(self.size)

    @property
    def buildings(self) -> int:
        """How many buildings there are."""
        return int(self.index.max(initial=-1)) + 1

    def centre(self) -> Float:
        """Centre of each body's footprint [m], shape (scene, vehicle, 2)."""
        ahead = np.stack([np.cos(self.heading), np.sin(self.heading)], axis=-1)
        found: Float = self.front - 0.5 * self.size[:, :1] * ahead
        return found

    def write(self, path: Path) -> None:
        """Write positions and sizes in whole millimetres, headings in microdegrees."""
        np.savez_compressed(
            path,
            front_mm=_whole(self.front / _MILLIMETRE),
            heading_microdegree=_whole(np.degrees(self.heading) / _MICRODEGREE),
            size_mm=_whole(self.size / _MILLIMETRE),
            vertex_mm=_whole(self.vertex / _MILLIMETRE),
            index=self.index,
        )

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read what `write` wrote."""
        with np.load(path, allow_pickle=False) as file:
            return cls(
                front=file["front_mm"] * _MILLIMETRE,
                heading=np.radians(file["heading_microdegree"] * _MICRODEGREE),
                size=file["size_mm"] * _MILLIMETRE,
                vertex=file["vertex_mm"] * _MILLIMETRE,
                index=file["index"],
            )


def _whole(numbers: Float) -> Array:
    return np.rint(numbers).astype(np.int32)


def there_and_back(scenes: int, wanted: int) -> npt.NDArray[np.intp]:
    """Indices of scenes to show, of `scenes`: to the end, back, and again; shape (wanted,).

    The grid of 200 vehicles was recorded for two seconds and is simulated for five. Every scene
    shown is one that SUMO produced, so distances, obstacles and their number are those of the
    recording; only the direction of motion is reversed on the way back, which no model reads.
    Two successive scenes always differ, so nothing can be kept from one to the next.
    """
    period = max(2 * (scenes - 1), 1)
    place = np.arange(wanted) % period
    return np.where(place < scenes, place, period - place)
