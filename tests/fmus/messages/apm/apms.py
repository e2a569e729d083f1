"""Strategies for abstract perception matrices of any size and content."""

from typing import Final

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from fmus.messages.apm import Apm, Layer, encode
from fmus.messages.records import APM_CELL, APM_HEADER, APM_LAYER_CELL
from orchestrator.signal import Array

coordinates = st.floats(-1e5, 1e5)

BORDERS: Final = (1, 2, 208, 209, 464, 465, 3792, 3793, 65535, 65536, 2**32 - 1)
"""Numbers of points at which the compressed form changes, and the ends of their range."""


@st.composite
def shapes(draw: st.DrawFn) -> tuple[int, int]:
    """Rows and columns; sometimes as long and narrow as they can be."""
    if draw(st.integers(0, 20)) == 0:
        long = draw(st.sampled_from([1024, 65535]))
        return draw(st.sampled_from([(1, long), (long, 1)]))
    return draw(st.integers(1, 24)), draw(st.integers(1, 24))


@st.composite
def matrices(draw: st.DrawFn) -> Array:
    """Cells: some share of them with points, of which some share are few."""
    shape = draw(shapes())
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    seen, few = draw(st.sampled_from([0.0, 0.02, 0.3, 1.0])), draw(st.sampled_from([0, 0.5, 1]))
    bits = rng.integers(1, 33, shape)
    many = rng.integers(0, 2**32, shape, np.uint64) >> (32 - bits).astype(np.uint64)
    many = np.where(rng.random(shape) < 0.3, rng.choice(BORDERS, shape), many)
    cells = np.where(rng.random(shape) < few, rng.integers(1, 250, shape), many)
    return np.where(rng.random(shape) < seen, cells, 0).astype(APM_CELL)


@st.composite
def seen_matrices(draw: st.DrawFn, levels: int) -> Array:
    """Cells of which some share of the ground is seen: noise, or patches as of a sensor."""
    shape = draw(shapes())
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if draw(st.booleans()):
        return rng.integers(0, levels + 1, shape).astype(APM_CELL)
    i, j = np.indices(shape)
    rate = draw(st.floats(0.0, 0.6))
    wave = np.sin(rate * i + rng.normal()) + np.cos(rate * j + rng.normal())
    scaled = (wave + draw(st.floats(-2.5, 2.5))) * levels
    cells: Array = np.clip(np.round(scaled), 0, levels).astype(APM_CELL)
    return cells


@st.composite
def layers(draw: st.DrawFn, cells: Array) -> Layer:
    """A layer for `cells` of few or many different objects."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    pool = rng.integers(0, 256, (draw(st.sampled_from([1, 5, 127, 128, 400])), 4), np.uint8)
    chosen = pool[rng.integers(0, len(pool), cells.shape)]
    chosen[..., 3] = rng.integers(0, 256, cells.shape)
    occupied = rng.random(cells.shape) < draw(st.sampled_from([0.0, 0.1, 0.5, 1.0]))
    if draw(st.integers(0, 5)):  # else also where no point is, which no sensor does
        occupied &= cells > 0
    return np.where(occupied[..., None], chosen, np.uint8(0)).view(APM_LAYER_CELL)[..., 0]


@st.composite
def apms(draw: st.DrawFn, levels: st.SearchStrategy[int] | None = None) -> Apm:
    """A matrix as any vehicle may send it, by default of points."""
    of = draw(levels) if levels is not None else 0
    cells = draw(seen_matrices(of) if of else matrices())
    return Apm(
        vehicle=draw(st.integers(0, 2**31 - 1)),
        time=draw(st.integers(0, 2**62)),
        position=np.array(draw(st.tuples(coordinates, coordinates))),
        heading=draw(st.floats(-10, 10)),
        center=np.array(draw(st.tuples(coordinates, coordinates))),
        cell=draw(st.floats(0.125, 64, width=32)),
        cells=cells,
        layer=draw(layers(cells)) if draw(st.booleans()) else None,
        levels=of,
    )


def seen_apms() -> st.SearchStrategy[Apm]:
    """A matrix of shares."""
    return apms(st.sampled_from([1, 2, 3, 15, 128, 255]) | st.integers(1, 255))


def any_apms() -> st.SearchStrategy[Apm]:
    """A matrix of either kind."""
    return apms() | seen_apms()


def apm_of(
    cells: npt.ArrayLike | None = None,
    *,
    vehicle: int = 1,
    time: int = 0,
    position: npt.ArrayLike = (0.0, 0.0),
    heading: float = 0.0,
    center: npt.ArrayLike = (0.0, 0.0),
    cell: float = 5.0,
    layer: Array | None = None,
) -> Apm:
    """A matrix around the origin, of 20 x 20 empty cells if none are given."""
    return Apm(
        vehicle=vehicle,
        time=time,
        position=np.array(position, float),
        heading=heading,
        center=np.array(center, float),
        cell=cell,
        cells=np.zeros((20, 20), np.uint32) if cells is None else np.asarray(cells, np.uint32),
        layer=layer,
    )


def plain(rows: int = 2, columns: int = 3) -> Apm:
    """A matrix of ascending indices without layer."""
    cells = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    position = (1.0, 2.0)
    return apm_of(cells, vehicle=7, time=5, position=position, heading=0.5, center=position)


def with_header(payload: bytes = b"", **fields: object) -> bytes:
    """A message of any payload, with these fields of its header replaced."""
    header = np.frombuffer(encode(plain()), APM_HEADER, 1).copy()
    for name, value in fields.items():
        header[name] = value
    return header.tobytes() + payload


def damaged(message: bytes, data: st.DataObject, shortest: int) -> bytes:
    """The message with up to four bits of its payload turned over, perhaps cut short."""
    found = bytearray(message)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(APM_HEADER.itemsize, len(found) - 1))
        found[place] ^= 1 << data.draw(st.integers(0, 7))
    end = data.draw(st.integers(shortest, len(found)) | st.just(len(found)))
    return bytes(found[:end])
