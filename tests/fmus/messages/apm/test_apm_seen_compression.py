"""The compressed form of shares of seen ground: short, bounded, and one for each matrix."""

import contextlib
import re
import tracemalloc
from dataclasses import replace
from math import log2

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from fmus.messages.apm import Apm, compressed_payload, decode, encode, message_size
from fmus.messages.apm.range_coder import Decision, Decoder, Encoder, decisions
from fmus.messages.apm.seen_compression import SEEN_CELLS_PER_BYTE
from fmus.messages.records import APM_COMPRESSED_FLAG, APM_LAYER_CELL, APM_LEVELS_SHIFT

from .apms import plain, seen_apms, with_header


def seen(cells: object, levels: int, layer: np.ndarray | None = None) -> Apm:
    """A matrix of shares."""
    return replace(plain(), cells=np.array(cells, np.uint32), levels=levels, layer=layer)


def with_payload(
    payload: bytes, *, rows: int = 2, columns: int = 3, levels: int = 3, layer: bool = False
) -> bytes:
    """A message with this compressed payload."""
    flags = levels << APM_LEVELS_SHIFT | APM_COMPRESSED_FLAG | int(layer)
    return with_header(payload, rows=rows, columns=columns, flags=flags)


def carrying(payload: bytes, apm: Apm) -> bytes:
    """A message of the form of `apm` with this compressed payload."""
    rows, columns = apm.cells.shape
    has_layer = apm.layer is not None
    return with_payload(payload, rows=rows, columns=columns, levels=apm.levels, layer=has_layer)


EXAMPLE = [[0, 0, 3], [0, 2, 3]]


def example_layer() -> np.ndarray:
    """In the last column one object, with 7 and 9 points on it."""
    layer = np.zeros((2, 3), APM_LAYER_CELL)
    layer[:, 2] = [(30, -4, 8, 7), (30, -4, 8, 9)]
    return layer


# ---- the form


@pytest.mark.parametrize(
    ("layer", "payload"), [(None, "5410"), (example_layer(), "542b41a05b0ac66f")]
)
def test_the_worked_examples_of_the_documentation(layer: np.ndarray | None, payload: str) -> None:
    apm = seen(EXAMPLE, 3, layer)
    message = with_payload(bytes.fromhex(payload), layer=layer is not None)
    assert compressed_payload(apm) == bytes.fromhex(payload)
    found = decode(message)
    np.testing.assert_array_equal(found.cells, apm.cells)
    assert found.levels == 3
    assert (found.layer is None) == (layer is None)
    if layer is not None:
        np.testing.assert_array_equal(found.layer, layer)


@given(seen_apms())
def test_a_compressed_message_is_never_longer_than_a_plain_one(apm: Apm) -> None:
    bound = message_size(*apm.cells.shape, layer=apm.layer is not None)
    assert len(encode(apm, compressed=True)) <= bound == len(encode(apm))


@pytest.mark.slow
@given(seen_apms())
def test_no_code_begins_with_another_one(apm: Apm) -> None:
    """Whatever is cut off or added: the message is refused."""
    payload = compressed_payload(apm)
    assert payload is not None
    for end in {0, len(payload) // 2, len(payload) - 1}:
        with pytest.raises(ValueError, match="compressed APM"):
            decode(carrying(payload[:end], apm))
    for more in (b"\0", b"\1", b"\xff", b"\x80\0\0\0"):
        with pytest.raises(ValueError, match=f"has {len(more)} bytes too many"):
            decode(carrying(payload + more, apm))


@given(seen_apms(), st.data())
def test_what_is_decoded_has_this_compressed_form_only(apm: Apm, data: st.DataObject) -> None:
    payload = bytearray(compressed_payload(apm) or b"")
    for _ in range(data.draw(st.integers(1, 4))):
        payload[data.draw(st.integers(0, len(payload) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    with contextlib.suppress(ValueError):
        assert compressed_payload(decode(carrying(bytes(payload), apm))) == bytes(payload)


@given(payload=st.binary(min_size=1, max_size=3), levels=st.integers(1, 4), layer=st.booleans())
def test_few_bytes_are_the_form_of_a_small_matrix_or_refused(
    payload: bytes, *, levels: int, layer: bool
) -> None:
    """Of so few bytes many are such a form."""
    message = with_payload(payload, rows=1, columns=2, levels=levels, layer=layer)
    with contextlib.suppress(ValueError):
        found = decode(message)
        assert found.cells.max() <= levels
        assert compressed_payload(found) == payload


@pytest.mark.parametrize(
    ("message", "wrong"),
    [
        (with_payload(b""), "2 x 3 cells does not fit into 72 bytes"),
        (with_payload(b"\0", rows=129, columns=128), "129 x 128 cells does not fit into 73 bytes"),
        (with_payload(b"\x54"), "a compressed APM is cut short"),
        (with_payload(b"\x54\x10\0"), "a compressed APM has 1 bytes too many"),
        (with_payload(b"\x54\x11"), "ends in other bytes than its cells make"),
        (with_payload(b"\x54\x10", layer=True), "a compressed APM is cut short"),
        (
            with_payload(bytes.fromhex("542b41a05b0ac670"), layer=True),
            "ends in other bytes than its cells make",
        ),
    ],
)
def test_a_malformed_message_is_refused_with_the_reason(message: bytes, wrong: str) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        decode(message)


def forged(*, repeats: bool) -> bytes:
    """A cell with an object that is written out although it is the expected one, or is nothing."""
    encoder = Encoder()
    encoder.decide(Decision(), yes=True)  # nothing is seen
    encoder.decide(Decision(), yes=True)  # an object
    encoder.decide(Decision(), yes=not repeats)  # the expected one, which is nothing
    if repeats:
        for about in (decisions(256) for _ in range(3)):
            encoder.byte(about, 0)
    encoder.byte(decisions(256), 0)
    return encoder.finish()


@pytest.mark.parametrize(
    ("repeats", "wrong"),
    [(True, "repeats an object instead of saying so"), (False, "has an object that is nothing")],
)
def test_another_form_of_a_layer_is_refused(*, repeats: bool, wrong: str) -> None:
    message = with_payload(forged(repeats=repeats), rows=1, columns=1, layer=True)
    with pytest.raises(ValueError, match=wrong):
        decode(message)


# ---- sizes and bounds


def disc(side: int) -> Apm:
    """What a sensor in the middle of an open plane sees, in side x side cells."""
    i, j = np.indices((side, side)) - (side - 1) / 2
    distance = np.hypot(i, j) / side
    return seen(np.clip(np.round((0.45 - distance) * side * 3), 0, 3), 3)


def test_what_is_seen_costs_its_border_not_its_area() -> None:
    """Twice as many rows and columns take about twice the bytes, not four times."""
    small, medium, large = [len(compressed_payload(disc(side)) or b"") for side in (60, 120, 240)]
    assert small < 100
    assert medium < 2.3 * small
    assert large < 2.3 * medium


def test_a_layer_where_nothing_is_seen_is_sent() -> None:
    """The ground below a car is not seen, but the car is."""
    layer = np.zeros((20, 20), APM_LAYER_CELL)
    layer[4, 5:8] = (30, 4, 0, 20)
    message = encode(seen(np.zeros((20, 20)), 3, layer), compressed=True)
    assert len(message) < 72 + 20
    np.testing.assert_array_equal(decode(message).layer, layer)


def test_noise_takes_little_more_than_its_information() -> None:
    """A byte for each cell, of which nothing can be learnt."""
    cells = np.random.default_rng(1).integers(0, 256, (80, 80))
    payload = compressed_payload(seen(cells, 255))
    assert payload is not None
    assert cells.size < len(payload) < 1.2 * cells.size


def test_no_matrix_takes_fewer_bytes_than_the_bound_on_its_cells() -> None:
    """The largest one, of which nothing is known but that nothing is seen, is still read."""
    apm = seen(np.zeros((1024, 1024)), 3)
    message = encode(apm, compressed=True)
    assert apm.cells.size / SEEN_CELLS_PER_BYTE < len(message) - 72 < 100
    assert decode(message).cells.tobytes() == apm.cells.tobytes()


@pytest.mark.slow
@given(payload=st.binary(max_size=100), rows=st.integers(1, 60), columns=st.integers(1, 60))
@example(payload=bytes(100), rows=160, columns=160)
@example(payload=b"\xff" * 100, rows=160, columns=160)
def test_a_message_takes_memory_for_its_cells_only(payload: bytes, rows: int, columns: int) -> None:
    message = with_payload(payload, rows=rows, columns=columns, layer=True)
    tracemalloc.start()
    with contextlib.suppress(ValueError):
        decode(message)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20 * rows * columns + 1_000_000


def test_the_largest_matrix_does_not_fit_into_few_bytes() -> None:
    message = with_payload(bytes(63), rows=1024, columns=1024)

    def refused() -> None:
        with pytest.raises(ValueError, match="does not fit into 135 bytes"):
            decode(message)

    refused()  # what is loaded at first use is no memory of a message
    tracemalloc.start()
    refused()
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20_000


# ---- the coder


@given(st.lists(st.booleans(), max_size=300), st.integers(1, 3))
def test_a_decoder_finds_the_decisions_of_the_encoder(answers: list[bool], kinds: int) -> None:
    about, again = decisions(kinds), decisions(kinds)
    encoder = Encoder()
    for k, yes in enumerate(answers):
        assert encoder.decide(about[k % kinds], yes=yes) == yes
    decoder = Decoder(encoder.finish())
    found = [decoder.decide(again[k % kinds], yes=False) for k in range(len(answers))]
    decoder.finish()
    assert found == answers


@given(st.integers(0, 255), st.data())
def test_a_byte_is_found_again_and_one_that_can_only_be_zero_is_free(
    most: int, data: st.DataObject
) -> None:
    bytes_ = data.draw(st.lists(st.integers(0, most), max_size=50))
    encoder, about = Encoder(), decisions(256)
    for byte in bytes_:
        assert encoder.byte(about, byte, most) == byte
    code = encoder.finish()
    decoder, about = Decoder(code), decisions(256)
    assert [decoder.byte(about, 0, most) for _ in bytes_] == bytes_
    if most == 0:
        assert len(code) == 1


@pytest.mark.parametrize(("share", "excess"), [(0.5, 0.03), (0.1, 0.05), (0.01, 0.2)])
def test_the_code_takes_little_more_than_the_information_of_its_decisions(
    share: float, excess: float
) -> None:
    """The entropy, and what it costs to look back on about 32 decisions only."""
    answers = np.random.default_rng(3).random(20_000) < share
    encoder, about = Encoder(), Decision()
    for yes in answers:
        encoder.decide(about, yes=bool(yes))
    found = answers.mean()
    entropy = -(found * log2(found) + (1 - found) * log2(1 - found)) * len(answers) / 8
    assert entropy < len(encoder.finish()) < (1 + excess) * entropy


@given(st.lists(st.booleans(), max_size=2000))
def test_no_decision_is_ever_certain(answers: list[bool]) -> None:
    about = Decision()
    for yes in answers + [answers[0]] * 2000 if answers else []:
        about.learn(yes=yes)
        assert 31 <= about.share <= 65536 - 31
