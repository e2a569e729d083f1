"""The compressed form of an APM: short, bounded, and refused with the reason if malformed."""

import contextlib
import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from fmus.messages.apm import Apm, decode, encode, message_size
from fmus.messages.apm.compression import CELLS_PER_BYTE
from fmus.messages.records import APM_COMPRESSED_FLAG, APM_HEADER, APM_LAYER_CELL

from .apms import apms, damaged, plain, with_header


def with_payload(payload: bytes, *, rows: int = 2, columns: int = 3, layer: bool = False) -> bytes:
    """A message with this compressed payload."""
    flags = APM_COMPRESSED_FLAG | int(layer)
    return with_header(payload, rows=rows, columns=columns, flags=flags)


def test_the_worked_example_of_the_documentation() -> None:
    """2 x 3 cells; the last two see one object, with 7 and 9 points on it."""
    cells = np.array([[0, 0, 5], [300, 4000, 70000]], np.uint32)
    layer = np.zeros((2, 3), APM_LAYER_CELL)
    layer[1, 1], layer[1, 2] = (30, -4, 8, 7), (30, -4, 8, 9)
    payload = bytes.fromhex("01 24 f05b fea00f ff70110100 01 ff1efc0807 8009")
    found = decode(with_payload(payload, layer=True))
    np.testing.assert_array_equal(found.cells, cells)
    np.testing.assert_array_equal(found.layer, layer)
    assert encode(found, compressed=True) == with_payload(payload, layer=True)


@pytest.mark.parametrize(
    ("message", "wrong"),
    [
        (with_payload(b""), "2 x 3 cells does not fit into 72 bytes"),
        (with_payload(b"\3", rows=4, columns=9), "4 x 9 cells does not fit into 73 bytes"),
        (with_payload(b"\4"), "a compressed APM is cut short"),
        (with_payload(b"\4\xff\1\1\1"), "a compressed APM is cut short"),
        (with_payload(b"\6"), "a run of 7 cells of a compressed APM passes its last cell"),
        (with_payload(b"\5\0"), "a compressed APM has 1 bytes too many"),
        (with_payload(b"\5\0", layer=True), "a compressed APM has 1 bytes too many"),
        (with_payload(b"\4\x20", layer=True), "a compressed APM is cut short"),
        (with_payload(b"\4\x20\1", layer=True), "a run of 2 cells of the layer of a compressed"),
        (with_payload(b"\4\x20\x80\1", layer=True), "compressed APM has no object 0 yet"),
        (with_payload(b"\4\x20\xff\1\1\1", layer=True), "a compressed APM is cut short"),
    ],
)
def test_a_malformed_compressed_message_is_refused_with_the_reason(
    message: bytes, wrong: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        decode(message)


@given(apms())
def test_a_compressed_message_is_never_longer_than_a_plain_one(apm: Apm) -> None:
    bound = message_size(*apm.cells.shape, layer=apm.layer is not None)
    assert len(encode(apm, compressed=True)) <= bound == len(encode(apm))


def test_a_matrix_full_of_noise_is_sent_plain() -> None:
    cells = np.random.default_rng(1).integers(2**24, 2**32, (20, 20), np.uint32)
    apm = replace(plain(20, 20), cells=cells)
    assert encode(apm, compressed=True) == encode(apm)


def test_a_layer_where_no_point_is_is_sent_plain() -> None:
    layer = np.zeros((2, 3), APM_LAYER_CELL)
    layer[0, 0] = (1, 0, 0, 0)  # plain() has no point in this cell
    apm = replace(plain(), layer=layer)
    assert encode(apm, compressed=True) == encode(apm)


def test_an_empty_matrix_takes_a_byte_per_32_cells() -> None:
    empty = replace(plain(20, 20), cells=np.zeros((20, 20), np.uint32))
    assert len(encode(empty, compressed=True)) == APM_HEADER.itemsize + 13


def test_small_counts_take_one_byte() -> None:
    for most, size in [(208, 1), (3792, 2), (65535, 3)]:
        apm = replace(plain(20, 20), cells=np.full((20, 20), most, np.uint32))
        assert len(encode(apm, compressed=True)) == APM_HEADER.itemsize + size * 400


@given(apms(), st.data())
def test_a_damaged_message_is_refused_or_is_a_matrix(apm: Apm, data: st.DataObject) -> None:
    message = damaged(encode(apm, compressed=True), data, shortest=0)
    with contextlib.suppress(ValueError):
        found = decode(message)
        assert decode(encode(found, compressed=True)).cells.tobytes() == found.cells.tobytes()


@given(
    payload=st.binary(max_size=100),
    rows=st.integers(1, 200),
    columns=st.integers(1, 64) | st.integers(1, 65535),
    layer=st.booleans(),
)
@example(payload=b"\x1f" * 100, rows=64, columns=50, layer=True)
def test_a_short_message_takes_little_memory(
    payload: bytes, *, rows: int, columns: int, layer: bool
) -> None:
    message = with_payload(payload, rows=rows, columns=columns, layer=layer)
    tracemalloc.start()
    with contextlib.suppress(ValueError):
        assert decode(message).cells.size <= len(payload) * CELLS_PER_BYTE
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 600 * len(payload) + 20_000


def open_road(side: int) -> Apm:
    """What the default lidar sees of an open plane, 2 m below, in side x side cells on 100 m."""
    elevation = np.radians(np.linspace(-20, 4, 64))
    down = elevation[elevation < 0]
    reach = (2 / np.tan(-down))[2 / np.sin(-down) <= 50]
    azimuth = 2 * np.pi * np.arange(1024) / 1024
    ring = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    hits = (reach[:, None, None] * ring).reshape(-1, 2)
    cell = 100 / side
    cells = np.zeros((side, side), np.uint32)
    row, column = np.floor(hits / cell + side / 2).astype(int).T
    np.add.at(cells, (row, column), 1)
    return replace(plain(), cells=cells, cell=cell)


@pytest.mark.parametrize(("side", "size"), [(10, 202), (20, 448), (40, 1235), (100, 4413)])
def test_sizes_on_an_open_road_are_those_of_the_documentation(side: int, size: int) -> None:
    """Points on the border of two cells may fall into either: a byte or two."""
    assert len(encode(open_road(side), compressed=True)) == pytest.approx(size, rel=0.01)
