"""Encoding loses nothing, not even the identity of a value, and trusts nothing."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from orchestrator.remote.block import WireError
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signal, Signals

DTYPES = ["<f8", "<f4", "<f2", ">f8", "<i8", "<i4", "<i2", "|i1", "<u8", "<u4", "|u1", "|b1",
          "<c16", "<c8", "<U3", "|S5", "<M8[ns]", "<m8[us]"]  # fmt: skip


def output(dtype: str | None) -> Connector:
    return Connector(causality=Causality.OUTPUT, dtype=dtype)


def bits(value: Signal) -> tuple[object, ...]:
    """Everything that makes two signals equal."""
    if isinstance(value, bytes):
        return (value,)
    return value.dtype.str, value.shape, value.tobytes()


def arrays(dtype: str) -> st.SearchStrategy[np.ndarray]:
    """Arrays of any rank and any bits: NaN payloads, -0.0, axes of length 0, strides."""
    plain = np.dtype(f"V{np.dtype(dtype).itemsize}")
    shapes = hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4)

    def build(shape: tuple[int, ...], raw: bytes, layout: int) -> np.ndarray:
        count = int(np.prod(shape))
        data = (raw * (count * plain.itemsize // max(1, len(raw)) + 1))[: count * plain.itemsize]
        if np.dtype(dtype).kind == "b":
            data = bytes(byte & 1 for byte in data)
        if np.dtype(dtype).kind == "U":
            data = bytes(65 if i % 4 == 0 else 0 for i in range(len(data)))
        value = np.frombuffer(data, plain).view(dtype).reshape(shape)
        if layout == 1:
            return value.T
        if layout == 2 and value.ndim:
            return value[::2]
        return value

    return st.builds(build, shapes, st.binary(min_size=1, max_size=64), st.integers(0, 2))


signals = st.one_of(st.binary(max_size=70), st.sampled_from(DTYPES).flatmap(arrays))
declared = st.sampled_from([None, *DTYPES])


def round_trip(encoder: SignalEncoder, decoder: SignalDecoder, values: Signals) -> Signals:
    return decoder.decode(b"".join(encoder.parts(values)))


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 3)])
def test_arrays_of_every_type_arrive_with_their_bits(dtype: str, shape: tuple[int, ...]) -> None:
    count = int(np.prod(shape)) * np.dtype(dtype).itemsize
    value = np.frombuffer(bytes(k % 2 for k in range(count)), np.uint8).view(dtype).reshape(shape)
    for declared_type in (dtype, "|i1" if dtype != "|i1" else "<f8"):  # what was agreed, or not
        connectors = {"x": output(declared_type)}
        encoder, decoder = SignalEncoder(connectors), SignalDecoder(connectors)
        found = round_trip(encoder, decoder, {"x": value})["x"]
        assert bits(found) == bits(value)


@given(st.lists(st.tuples(declared, signals), max_size=6))
def test_what_is_decoded_has_the_bits_of_what_was_encoded(
    pairs: list[tuple[str | None, Signal]],
) -> None:
    # whether or not a value has the declared type: what to say about that is not ours to decide
    connectors = {f"s{i}": output(dtype) for i, (dtype, _) in enumerate(pairs)}
    values = {f"s{i}": value for i, (_, value) in enumerate(pairs)}
    connectors = {
        name: output("<f8") if c.is_binary and not isinstance(values[name], bytes) else c
        for name, c in connectors.items()
    }
    decoded = round_trip(SignalEncoder(connectors), SignalDecoder(connectors), values)
    assert list(decoded) == list(values)
    assert {n: bits(v) for n, v in decoded.items()} == {n: bits(v) for n, v in values.items()}


@given(st.lists(st.integers(0, 3), min_size=1, max_size=12))
def test_the_receiver_sees_the_same_object_exactly_when_the_sender_gave_the_same(
    choices: list[int],
) -> None:
    connectors = {"array": output("<f8"), "text": output(None)}
    encoder, decoder = SignalEncoder(connectors), SignalDecoder(connectors)
    pool = [(np.full(2, float(i)), bytes([i, i])) for i in range(4)]
    previous = -1
    before: Signals = {}
    for choice in choices:
        array, text = pool[choice]
        decoded = round_trip(encoder, decoder, {"array": array, "text": text})
        assert bits(decoded["array"]) == bits(array)
        assert decoded["text"] == text
        if previous >= 0:
            assert (decoded["array"] is before["array"]) == (choice == previous)
            assert (decoded["text"] is before["text"]) == (choice == previous)
        previous, before = choice, decoded


def test_an_unchanged_value_costs_sixteen_bytes() -> None:
    connectors = {"points": output(None)}
    encoder = SignalEncoder(connectors)
    points = bytes(300_000)
    first, second = (len(b"".join(encoder.parts({"points": points}))) for _ in range(2))
    assert first > 300_000
    assert second == 32


def test_decoded_arrays_are_read_only_aligned_views_of_the_message() -> None:
    connectors = {"a": output("|i1"), "b": output("<f8"), "c": output(None), "d": output("<c16")}
    values: Signals = {
        "a": np.ones(3, np.int8),
        "b": np.ones((5, 1)),
        "c": b"xyz",
        "d": np.ones(2, complex),
    }
    message = b"".join(SignalEncoder(connectors).parts(values))
    decoded = SignalDecoder(connectors).decode(message)
    for name in ("a", "b", "d"):
        value = decoded[name]
        assert isinstance(value, np.ndarray)
        assert not value.flags.writeable
        assert value.flags.aligned
        assert value.__array_interface__["data"][0] % 16 == 0
        assert np.shares_memory(value, np.frombuffer(message, np.uint8))


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (1.5, "`x` is float, neither an array nor bytes; write `np.asarray"),
        (np.array([object()]), "`x` has elements of type object, which cannot travel"),
        (np.zeros(1, [("a", "i4")]), "which cannot travel"),
    ],
)
def test_values_that_are_no_signals_are_refused(value: Signal, complaint: str) -> None:
    with pytest.raises(WireError, match=complaint):
        SignalEncoder({"x": output("<f8")}).parts({"x": value})


def test_a_name_that_is_not_declared_is_refused() -> None:
    with pytest.raises(WireError, match="`y` is not a connector of that causality"):
        SignalEncoder({"x": output("<f8")}).parts({"y": np.zeros(())})


CONNECTORS = {"a": output("<f8"), "b": output(None), "c": output("|b1"), "d": output("<f4")}
MESSAGE = b"".join(
    SignalEncoder(CONNECTORS).parts(
        {"a": np.ones((2, 3)), "b": b"hello", "c": np.array(True), "d": np.zeros((0, 4))}
    )
)


@given(st.integers(0, len(MESSAGE) - 1))
def test_a_truncated_message_is_refused(length: int) -> None:
    with pytest.raises(WireError):
        SignalDecoder(CONNECTORS).decode(MESSAGE[:length])


@given(st.binary(min_size=1, max_size=40))
def test_bytes_behind_the_signals_are_refused(tail: bytes) -> None:
    with pytest.raises(WireError, match="end at byte"):
        SignalDecoder(CONNECTORS).decode(MESSAGE + tail)


def decodes_or_refuses(message: bytes) -> None:
    """Any outcome but a `WireError` or arrays within the message is a crash in the making."""
    try:
        decoded = SignalDecoder(CONNECTORS).decode(message)
    except WireError:
        return
    for value in decoded.values():
        size = len(value) if isinstance(value, bytes) else value.nbytes
        assert size <= len(message)


@given(st.binary(max_size=200))
def test_garbage_is_refused_or_decoded_within_bounds(message: bytes) -> None:
    decodes_or_refuses(message)


@given(st.lists(st.tuples(st.integers(0, len(MESSAGE) - 1), st.integers(0, 255)), max_size=5))
def test_a_damaged_message_is_refused_or_decoded_within_bounds(
    damage: list[tuple[int, int]],
) -> None:
    message = bytearray(MESSAGE)
    for place, byte in damage:
        message[place] = byte
    decodes_or_refuses(bytes(message))


@pytest.mark.parametrize("rank", [1, 2, 3, 4, 5])
def test_values_of_as_many_bytes_and_other_shapes_are_told_apart(rank: int) -> None:
    """What is remembered of the entry before does not stand for the shape of the next one."""
    connectors = {"a": output("<f8")}
    encoder, decoder = SignalEncoder(connectors), SignalDecoder(connectors)
    for k in (0, rank - 1, 0):
        shape = [1] * rank
        shape[k] = 6
        value = np.arange(6.0).reshape(shape)
        decoded = round_trip(encoder, decoder, {"a": value})["a"]
        assert bits(decoded) == bits(value)
