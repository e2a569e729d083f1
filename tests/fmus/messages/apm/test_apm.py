"""The APM message: encoding and decoding are inverse, and nothing malformed gets through."""

import contextlib
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import (
    HEIGHT_STEP,
    VELOCITY_STEP,
    Apm,
    decode,
    encode,
    join,
    layer_height,
    layer_velocity,
    message_size,
    split,
)
from fmus.messages.records import APM_HEADER, APM_LAYER_CELL

from .apms import any_apms, apm_of, apms, plain, with_header


@given(apm=any_apms(), compressed=st.booleans())
def test_decoding_inverts_encoding(apm: Apm, *, compressed: bool) -> None:
    found = decode(encode(apm, compressed=compressed))
    for name in ("vehicle", "time", "heading", "cell", "levels"):
        assert getattr(found, name) == getattr(apm, name)
    np.testing.assert_array_equal(found.position, apm.position)
    np.testing.assert_array_equal(found.center, apm.center)
    np.testing.assert_array_equal(found.cells, apm.cells)
    assert (found.layer is None) == (apm.layer is None)
    if apm.layer is not None and found.layer is not None:
        np.testing.assert_array_equal(found.layer, apm.layer)


@given(apm=any_apms(), compressed=st.booleans())
def test_encoding_inverts_decoding(apm: Apm, *, compressed: bool) -> None:
    message = encode(apm, compressed=compressed)
    assert encode(decode(message), compressed=compressed) == message


@given(st.lists(st.binary(max_size=40), max_size=6))
def test_splitting_inverts_joining(messages: list[bytes]) -> None:
    assert split(join(messages)) == messages


def test_the_cells_of_a_20_by_20_matrix_take_the_1600_bytes_of_the_paper() -> None:
    assert len(encode(plain(20, 20))) - APM_HEADER.itemsize == 1600
    assert message_size(20, 20, layer=True) - message_size(20, 20, layer=False) == 1600


@given(apms(), st.tuples(st.floats(0.01, 0.99), st.floats(0.01, 0.99)))
def test_a_point_inside_a_cell_is_located_in_it(apm: Apm, inside: tuple[float, float]) -> None:
    index = np.moveaxis(np.indices(apm.cells.shape), 0, -1)
    located = apm.locate(apm.world(index + np.array(inside)))
    np.testing.assert_array_equal(located, index)
    assert apm.contains(located).all()
    assert not apm.contains(located + apm.cells.shape).any()
    assert not apm.contains(located - apm.cells.shape).any()


def test_rows_run_forward_and_columns_to_the_left() -> None:
    north = apm_of(np.zeros((4, 4)), heading=np.pi / 2)
    assert north.locate(np.array([0.1, 7.0])).tolist() == [3, 1]  # ahead, a little to the right
    assert north.locate(np.array([-7.0, -0.1])).tolist() == [1, 3]  # to the left
    np.testing.assert_allclose(north.cell_centers()[3, 0], [7.5, 7.5], atol=1e-12)


def test_the_layer_is_read_in_metres() -> None:
    layer = np.array([[(64, -20, 40, 255)]], APM_LAYER_CELL)
    assert layer_height(layer)[0, 0] == pytest.approx(64 * HEIGHT_STEP)
    np.testing.assert_allclose(layer_velocity(layer)[0, 0], [-20 * VELOCITY_STEP, 10.0])


def edited(field: str, value: object) -> bytes:
    message = np.frombuffer(encode(plain()), np.uint8).copy()
    message[: APM_HEADER.itemsize].view(APM_HEADER)[field] = value
    return message.tobytes()


@pytest.mark.parametrize(
    ("message", "wrong"),
    [
        (b"", "has at least 72 bytes, not 0"),
        (encode(plain())[:71], "has at least 72 bytes, not 71"),
        (encode(plain())[:-1], "2 x 3 cells without layer has 96 bytes, not 95"),
        (encode(plain()) + b"\0", "has 96 bytes, not 97"),
        (edited("magic", b"NOPE"), "not an APM message of version 1: magic b'NOPE', version 1"),
        (edited("version", 2), "version 2"),
        (edited("flags", 1), "with layer has 120 bytes, not 96"),
        (edited("flags", 4), "unknown flags 0x0004"),
        (edited("flags", 0x80), "unknown flags 0x0080"),
        (edited("flags", 0x400), "an APM of 4 levels has a cell of 5"),
        (edited("vehicle", -1), "vehicle -1, must be >= 0"),
        (edited("rows", 0), "0 x 3 cells is empty"),
        (edited("columns", 65535), "2 x 65535 cells without layer"),
        (edited("rows", 65535), "65535 x 3 cells without layer"),
        (with_header(rows=65535, columns=65535), "65535 x 65535 cells is too large: at most 1048"),
        (edited("cell", np.nan), "cells of nan m"),
        (edited("cell", 0.0), "cells of 0.0 m, must be finite and > 0"),
        (edited("position", np.inf), "the position of an APM is not finite"),
        (edited("heading", np.nan), "the heading of an APM is not finite"),
        (edited("center", [0.0, np.nan]), "the center of an APM is not finite"),
    ],
)
def test_a_malformed_message_is_refused_with_the_reason(message: bytes, wrong: str) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        decode(message)


SIGNAL = join([b"12345", b""])


@pytest.mark.parametrize(
    ("signal", "wrong"),
    [
        (b"APMS", "at least 16 bytes, not 4"),
        (b"OBJS" + SIGNAL[4:], "not an `APMS` frame of version 1"),
        (SIGNAL[:12] + b"\1" + SIGNAL[13:], "not an `APMS` frame of version 1"),
        (SIGNAL[:24], "cut short in message 0 of 5 bytes"),
        (SIGNAL[:-1], "cut short before message 1"),
        (SIGNAL + bytes(8), "8 bytes after its messages"),
    ],
)
def test_a_malformed_signal_is_refused_with_the_reason(signal: bytes, wrong: str) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        split(signal)


def test_the_levels_are_the_upper_byte_of_the_flags() -> None:
    apm = replace(plain(), levels=5)
    header = np.frombuffer(encode(apm), APM_HEADER, 1)[0]
    assert header["flags"] == 0x500
    assert decode(encode(apm)).levels == 5


@pytest.mark.parametrize(
    ("levels", "wrong"),
    [
        (-1, "an APM of -1 levels does not fit: 0 to 255"),
        (256, "an APM of 256 levels does not fit: 0 to 255"),
        (4, "an APM of 4 levels has a cell of 5"),
    ],
)
def test_levels_that_the_cells_do_not_have_are_refused(levels: int, wrong: str) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        encode(replace(plain(), levels=levels))


def test_no_data_yet_and_no_messages_are_both_empty() -> None:
    assert split(b"") == []
    assert split(join([])) == []


@given(st.binary(max_size=200))
def test_bytes_off_the_air_are_decoded_or_refused_never_anything_else(noise: bytes) -> None:
    for prefix in (b"", b"APMM\1\0", b"APMS\1\0\0\0"):
        for read in (decode, split):
            with contextlib.suppress(ValueError):
                read(prefix + noise)


@pytest.mark.parametrize(
    ("cells", "layer", "wrong"),
    [
        (np.zeros((2, 2), np.int64), None, "cells are int64[2, 2], must be uint32[rows, columns]"),
        (np.zeros(4, np.uint32), None, "cells are uint32[4]"),
        (np.zeros((65536, 1), np.uint32), None, "65536 x 1 cells does not fit"),
        (np.zeros((1025, 1024), np.uint32), None, "1025 x 1024 cells is too large"),
        (np.zeros((2, 2), np.uint32), np.zeros((2, 3), APM_LAYER_CELL), "[2, 3], must be"),
        (np.zeros((0, 2), np.uint32), None, "0 x 2 cells is empty"),
    ],
)
def test_what_cannot_be_sent_is_refused(
    cells: np.ndarray, layer: np.ndarray | None, wrong: str
) -> None:
    apm = Apm(
        vehicle=0,
        time=0,
        position=np.zeros(2),
        heading=0.0,
        center=np.zeros(2),
        cell=1.0,
        cells=cells,
        layer=layer,
    )
    with pytest.raises(ValueError, match=re.escape(wrong)):
        encode(apm)
