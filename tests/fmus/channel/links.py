"""The links of a scene as matrices, from the compiled formulas of the channel."""

import ctypes
from collections.abc import Sequence
from ctypes import POINTER, c_bool, c_double, c_int32, c_size_t, c_uint32
from dataclasses import dataclass, field

import numpy as np

from orchestrator.signal import Array

from .primitives import PathLoss, Primitives, Ring


@dataclass(frozen=True, slots=True, kw_only=True)
class Propagation:
    """Parameters of the channel; by default those of the channel."""

    carrier_frequency: float = 5.9e9
    path_loss: PathLoss = field(default_factory=PathLoss)
    maximum_range: float = 2600.0
    wall_loss: float = 9.0
    indoor_loss: float = 0.4
    knife_edge_factor: float = 2.0
    antenna_gain: Sequence[float] = (0.0,)
    band_edges: bool = True
    building_shadowing: bool = True
    finite_buildings: bool = True
    vehicle_shadowing: bool = True
    reciprocal: bool = True


VEINS = Propagation(
    path_loss=PathLoss(lossless_distance=1.0), finite_buildings=False, reciprocal=False
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Town:
    """Vehicles and buildings.

    Attributes:
        position: of the vehicles' centres on the ground [m], shape (vehicle, 3).
        heading: [rad], shape (vehicle,).
        size: length, width, height [m], shape (vehicle, 3).
        antenna_height: above the ground [m], shape (vehicle,).
        equipped: shape (vehicle,).
        buildings: rings with heights.
    """

    position: Array
    heading: Array
    size: Array
    antenna_height: Array
    equipped: Array
    buildings: Sequence[Ring] = ()

    @property
    def vehicles(self) -> int:
        """Their number."""
        return len(self.heading)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkMatrix:
    """All links; row = transmitter, column = receiver.

    Attributes:
        gain: shape (vehicle, vehicle, 3); 0 where there is no link.
        distance: [m], shape (vehicle, vehicle).
        kind: 0 LOS, 1 NLOSv, 2 NLOSb.
        rank: place of the receiver in the row, -1 if it is not in it.
    """

    gain: Array
    distance: Array
    kind: Array
    rank: Array

    @staticmethod
    def empty(n: int) -> "LinkMatrix":
        """Without any link."""
        return LinkMatrix(
            gain=np.zeros((n, n, 3)),
            distance=np.zeros((n, n)),
            kind=np.zeros((n, n), np.int32),
            rank=np.full((n, n), -1, np.int32),
        )


class _Model(ctypes.Structure):
    _fields_ = (
        *((name, c_double) for name in (
            "carrier_frequency", "path_loss", "path_loss_exponent", "lossless_distance",
            "permittivity", "breakpoint_distance", "breakpoint_near_loss", "breakpoint_far_loss",
            "breakpoint_far_exponent", "maximum_range", "wall_loss", "indoor_loss",
            "knife_edge_factor",
        )),
        *((name, c_bool) for name in (
            "band_edges", "building_shadowing", "finite_buildings", "vehicle_shadowing",
            "reciprocal",
        )),
        ("antenna_gains", c_size_t), ("antenna_gain", POINTER(c_double)),
    )  # fmt: skip


class _Town(ctypes.Structure):
    _fields_ = (
        *((name, c_size_t) for name in ("vehicles", "buildings", "corners")),
        *((name, POINTER(c_double)) for name in ("position", "heading", "size", "antenna_height")),
        ("equipped", POINTER(c_bool)),
        *((name, POINTER(c_double)) for name in ("corner", "building_height")),
        ("index", POINTER(c_int32)),
    )  # fmt: skip


class _Announced(ctypes.Structure):
    _fields_ = (("workers", c_size_t), ("width", c_size_t), ("radio", POINTER(c_uint32)))


class _Matrix(ctypes.Structure):
    _fields_ = (
        *((name, POINTER(c_double)) for name in ("gain", "distance")),
        *((name, POINTER(c_int32)) for name in ("kind", "rank")),
    )


def _floats(values: object) -> ctypes.Array[c_double]:
    flat = np.ravel(np.asarray(values, float))
    return (c_double * len(flat))(*flat)


def _model(p: Propagation) -> _Model:
    loss = p.path_loss
    return _Model(
        p.carrier_frequency, loss.number, loss.exponent, loss.lossless_distance, loss.permittivity,
        loss.breakpoint_distance, loss.breakpoint_near_loss, loss.breakpoint_far_loss,
        loss.breakpoint_far_exponent, p.maximum_range, p.wall_loss, p.indoor_loss,
        p.knife_edge_factor, p.band_edges, p.building_shadowing, p.finite_buildings,
        p.vehicle_shadowing, p.reciprocal, len(p.antenna_gain), _floats(p.antenna_gain),
    )  # fmt: skip


def _town(town: Town) -> _Town:
    index = [k for k, ring in enumerate(town.buildings) for _ in ring.corners]
    return _Town(
        town.vehicles, len(town.buildings), len(index), _floats(town.position),
        _floats(town.heading), _floats(town.size), _floats(town.antenna_height),
        (c_bool * town.vehicles)(*(bool(x) for x in town.equipped)),
        _floats([corner for ring in town.buildings for corner in ring.corners]),
        _floats([ring.height for ring in town.buildings]), (c_int32 * len(index))(*index),
    )  # fmt: skip


def _matrix(m: LinkMatrix) -> _Matrix:
    return _Matrix(
        m.gain.ctypes.data_as(POINTER(c_double)), m.distance.ctypes.data_as(POINTER(c_double)),
        m.kind.ctypes.data_as(POINTER(c_int32)), m.rank.ctypes.data_as(POINTER(c_int32)),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Announced:
    """What is announced while rows are asked for.

    Attributes:
        workers: threads that find them, the caller among them; 0: nothing is announced.
        width: so many rows are announced in front of each so many rows that are asked for.
        radios: whose rows are announced, at least as many as are asked for.
    """

    workers: int
    width: int
    radios: Sequence[int]


NOTHING = Announced(workers=0, width=1, radios=())


def link_rows(
    primitives: Primitives,
    town: Town,
    propagation: Propagation,
    floor: float | Sequence[float] = 0.0,
    order: Sequence[int] | None = None,
    *,
    announced: Announced = NOTHING,
) -> LinkMatrix:
    """The rows of the transmitters in `order`, each with its floor (or all with one)."""
    out = LinkMatrix.empty(town.vehicles)
    rows = list(range(town.vehicles) if order is None else order)
    floors = [float(x) for x in np.broadcast_to(np.asarray(floor, float), len(rows))]
    failed = primitives.library.link_rows(
        ctypes.byref(_town(town)), ctypes.byref(_model(propagation)), c_size_t(len(rows)),
        (c_uint32 * len(rows))(*rows), _floats(floors),
        ctypes.byref(_Announced(announced.workers, announced.width,
                                (c_uint32 * len(announced.radios))(*announced.radios))),
        ctypes.byref(_matrix(out)),
    )  # fmt: skip
    assert not failed
    return out


def link_rows_of_scenes(
    primitives: Primitives,
    scenes: Sequence[tuple[Town, Propagation]],
    floor: float,
    negligible: float,
) -> LinkMatrix:
    """The rows of the last scene, after all rows and links of those before it were asked for.

    A town without buildings has those of the town before.
    """
    out = LinkMatrix.empty(scenes[-1][0].vehicles)
    failed = primitives.library.link_rows_of_scenes(
        c_size_t(len(scenes)), (_Town * len(scenes))(*(_town(town) for town, _ in scenes)),
        (_Model * len(scenes))(*(_model(p) for _, p in scenes)), c_double(floor),
        c_double(negligible), ctypes.byref(_matrix(out)),
    )  # fmt: skip
    assert not failed
    return out


def least_loss(
    primitives: Primitives, town: Town, propagation: Propagation, floor: float = 1e-30
) -> int:
    """What buildings take at least from links between the cells of the first two vehicles [dB]."""
    loss = primitives.library.least_loss(
        ctypes.byref(_town(town)), ctypes.byref(_model(propagation)), c_double(floor)
    )
    assert loss >= 0
    return int(loss)


def link_pairs(
    primitives: Primitives, town: Town, propagation: Propagation, negligible: float | None = None
) -> LinkMatrix:
    """Every link on its own, whatever its length; the rank means nothing.

    With `negligible`, links between radios come from the views that the channel keeps.
    """
    out = LinkMatrix.empty(town.vehicles)
    failed = primitives.library.link_pairs(
        ctypes.byref(_town(town)), ctypes.byref(_model(propagation)), negligible is not None,
        c_double(negligible or 0.0), ctypes.byref(_matrix(out)),
    )  # fmt: skip
    assert not failed
    return out
