"""The formulas of the channel, compiled from the sources of the FMU, on arrays."""

from collections.abc import Sequence
from ctypes import c_bool, c_double, c_int64, c_size_t, c_uint8, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.native.unit import compile_parts, load_unit
from orchestrator.signal import Array

from .harness import LIGHT_SPEED

FORMULAS: Final = (  # sources that need no FMI shell
    "geometry.c", "area_index.c", "sort.c", "path_loss.c", "antenna.c", "building_shadowing.c",
    "knife_edge.c", "vehicle_shadowing.c", "pair.c", "gap.c", "street_cells.c", "surroundings.c",
    "team.c", "link.c",
    "modulation.c", "error_rate.c",
    "random.c", "portable_math.c",
)  # fmt: skip


def _pointer(array: Array) -> c_void_p:
    assert array.flags.c_contiguous
    return array.ctypes.data_as(c_void_p)


def _floats(values: object) -> Array:
    return np.ascontiguousarray(values, float)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ring:
    """A building."""

    corners: Sequence[Sequence[float]]
    height: float = np.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A vehicle: centre on the ground [m], heading [rad], length, width, height [m]."""

    center: tuple[float, float, float]
    heading: float
    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLoss:
    """A path loss model; the parameters are those of the channel."""

    model: str = "exponent"
    exponent: float = 2.0
    lossless_distance: float = 0.0
    permittivity: float = 1.02
    breakpoint_distance: float = 80.0
    breakpoint_near_loss: float = 47.85
    breakpoint_far_loss: float = 85.91
    breakpoint_far_exponent: float = 4.0

    def row(self, frequency: float) -> tuple[float, ...]:
        """As the compiled library takes it."""
        return (
            LIGHT_SPEED / frequency, self.number, self.exponent, self.lossless_distance,
            self.permittivity, self.breakpoint_distance, self.breakpoint_near_loss,
            self.breakpoint_far_loss, self.breakpoint_far_exponent,
        )  # fmt: skip

    @property
    def number(self) -> float:
        """Of the model, as in the enumeration `path_loss`."""
        return 1.0 + ("exponent", "two_ray", "breakpoint").index(self.model)


class Primitives:
    """The compiled library; links are arrays of shape (n, 3) [m]."""

    def __init__(self, folder: Path) -> None:
        wrapper = Path(__file__).with_suffix(".c")
        self.library = compile_parts(load_unit("channel"), FORMULAS, wrapper=wrapper, folder=folder)
        self.library.profile_loss.restype = c_double
        self.library.lowest_path_loss.restype = c_double
        self.library.pattern_gain.restype = c_double
        self.library.duration.restype = c_int64

    def path_loss(
        self, a: object, b: object, frequency: object, models: Sequence[PathLoss] | PathLoss
    ) -> Array:
        """Path loss [dB], shape (n,), each link with its model or all with one."""
        tx, rx = _floats(a), _floats(b)
        each = [models] * len(tx) if isinstance(models, PathLoss) else models
        frequencies = np.broadcast_to(_floats(frequency), len(tx))
        rows = _floats([m.row(float(f)) for m, f in zip(each, frequencies, strict=True)])
        loss = np.empty(len(tx))
        self.library.path_losses(
            c_size_t(len(tx)), _pointer(tx), _pointer(rx), _pointer(rows), _pointer(loss)
        )
        return loss

    def lowest_path_loss(self, frequency: float, model: PathLoss, distance: float) -> float:
        """The bound below which no path of at least `distance` [m] on the ground comes [dB]."""
        row = _floats(model.row(frequency))
        loss: float = self.library.lowest_path_loss(_pointer(row), c_double(distance))
        return loss

    def pattern_gain(self, gains: object, azimuth: float) -> float:
        """Gain of a sampled antenna pattern [dB] at an azimuth from the heading on [rad]."""
        samples = _floats(gains)
        gain: float = self.library.pattern_gain(
            c_size_t(len(samples)), _pointer(samples), c_double(azimuth)
        )
        return gain

    def penetration(
        self, rings: Sequence[Ring], a: object, b: object, *, finite: bool = False
    ) -> tuple[Array, Array]:
        """Walls and metres indoors, shape (n,) each."""
        tx, rx = _floats(a), _floats(b)
        corner = _floats([corner for ring in rings for corner in ring.corners])
        index = np.array([k for k, ring in enumerate(rings) for _ in ring.corners], np.int32)
        height = _floats([ring.height for ring in rings])
        walls, indoors = np.empty(len(tx)), np.empty(len(tx))
        failed = self.library.penetrations(
            c_size_t(len(index)), _pointer(corner), _pointer(index), c_size_t(len(rings)),
            _pointer(height), c_bool(finite), c_size_t(len(tx)), _pointer(tx), _pointer(rx),
            _pointer(walls), _pointer(indoors),
        )  # fmt: skip
        assert not failed
        return walls, indoors

    def shadow(
        self,
        bodies: Sequence[Body],
        a: object,
        b: object,
        *,
        own: Sequence[tuple[int, int]] | None = None,
        frequency: object = 5.9e9,
        reciprocal: bool = True,
        factor: float = 2.0,
        back: bool = False,
    ) -> tuple[Array, Array]:
        """Loss [dB] from `a` to `b`, or back, and whether a body blocks the line of sight, (n,)."""
        tx, rx = _floats(a), _floats(b)
        owners = np.array(own or [(-1, -1)] * len(tx), np.int64)
        own_a, own_b = np.ascontiguousarray(owners[:, 0]), np.ascontiguousarray(owners[:, 1])
        center = _floats([body.center for body in bodies])
        heading = _floats([body.heading for body in bodies])
        size = _floats([body.size for body in bodies])
        wavelength = _floats(LIGHT_SPEED / np.broadcast_to(_floats(frequency), len(tx)))
        loss, blocked = np.empty((len(tx), 2)), np.empty((len(tx), 2), np.bool_)
        failed = self.library.shadows(
            c_size_t(len(bodies)), _pointer(center), _pointer(heading), _pointer(size),
            c_bool(reciprocal), c_double(factor), c_size_t(len(tx)), _pointer(tx), _pointer(rx),
            _pointer(own_a), _pointer(own_b), _pointer(wavelength), _pointer(loss),
            _pointer(blocked),
        )  # fmt: skip
        assert not failed
        return loss[:, int(back)], blocked[:, int(back)]

    def profile_loss(self, profile: object, frequency: float, factor: float = 2.0) -> float:
        """Loss over a profile of (distance, height) from antenna to antenna [dB]."""
        points = _floats(profile)
        distance, height = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
        loss: float = self.library.profile_loss(
            c_size_t(len(points)), _pointer(distance), _pointer(height),
            c_double(LIGHT_SPEED / frequency), c_double(factor),
        )  # fmt: skip
        return loss

    def success(self, bitrate: float, snir_db: object, bits: object) -> tuple[Array, Array, Array]:
        """Probability that `bits` bits, a header, a frame of so many bits are decoded."""
        snir, n = 10 ** (_floats(snir_db) / 10), len(_floats(snir_db))
        chunk, header, payload = np.empty(n), np.empty(n), np.empty(n)
        failed = self.library.successes(
            c_double(bitrate), c_size_t(n), _pointer(snir), _pointer(_floats(bits)),
            _pointer(chunk), _pointer(header), _pointer(payload),
        )  # fmt: skip
        assert not failed
        return chunk, header, payload

    def duration(self, bitrate: float, size: int) -> int:
        """Of a frame of `size` bytes [ns]."""
        return int(self.library.duration(c_double(bitrate), c_uint32(size)))

    def philox(self, counter: Sequence[int], key: Sequence[int]) -> list[int]:
        """One block of the generator."""
        out = np.empty(4, np.uint32)
        self.library.philox(
            _pointer(np.array(counter, np.uint32)), _pointer(np.array(key, np.uint32)),
            _pointer(out),
        )  # fmt: skip
        return [int(word) for word in out]

    def uniforms(self, seed: int, packet: int, hop: int, receivers: int) -> Array:
        """The two draws of each receiver, shape (receivers, 2)."""
        out = np.empty((receivers, 2))
        self.library.uniforms(
            c_uint64(seed), c_int64(packet), c_uint8(hop), c_size_t(receivers), _pointer(out)
        )
        return out
