"""The stream of a tap: what is written is read, bit for bit, also by JavaScript."""

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from orchestrator.remote.block import WireError
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.tap.stream import (
    HEADER,
    MAGIC,
    PUBLICATIONS,
    PUBLISHED,
    Kind,
    Message,
    Reader,
    Schema,
    Writer,
    append,
    messages,
)

ROOT = Path(__file__).parents[2]
TYPES = ["<f8", "<f4", "<i8", "<i4", "<i2", "|i1", "<u8", "<u4", "<u2", "|u1", "|b1"]


def output(**declared: Any) -> Connector:
    return Connector(causality=Causality.OUTPUT, **declared)


def schema_of(**outputs: Connector) -> Schema:
    named = {name.replace("__", "."): connector for name, connector in outputs.items()}
    return Schema.of("a run", (5, 10**12), ["a", "b"], named)


def own(t: int) -> dict[str, Any]:
    return {PUBLISHED: np.array([t, t - 1]), PUBLICATIONS: np.array([3, 2**40])}


@st.composite
def arrays(draw: st.DrawFn) -> np.ndarray[Any, Any]:
    """Arrays of any type that a reader in a browser knows, of rank 0 to 3, with any bits."""
    dtype = np.dtype(draw(st.sampled_from(TYPES)))
    shape = tuple(draw(st.lists(st.integers(0, 3), max_size=3)))
    count = int(np.prod(shape, dtype=int))
    raw = draw(st.binary(min_size=count * dtype.itemsize, max_size=count * dtype.itemsize))
    if dtype.kind == "b":
        raw = bytes(byte & 1 for byte in raw)
    return np.frombuffer(raw, dtype).reshape(shape)


def same(one: Any, other: Any) -> bool:
    if isinstance(one, bytes) or isinstance(other, bytes):
        return bool(one == other)
    return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())


@given(st.lists(st.tuples(arrays(), st.binary(max_size=40)), min_size=1, max_size=4))
def test_what_is_written_is_read(steps: list[tuple[np.ndarray[Any, Any], bytes]]) -> None:
    """Values that stay the same object travel once; others, of whatever type, each time."""
    schema = schema_of(a__x=output(shape=(None,)), b__raw=output(dtype=None))
    writer, reader = Writer(schema), Reader()
    kept = np.array([1.5, np.nan])
    reader.decode(writer.schema())
    assert reader.schema == schema
    for number, (array, raw) in enumerate(steps):
        values: Signals = {**own(number), "a.x": array if number % 2 else kept, "b.raw": raw}
        sent = Message(kind=Kind.VALUES, t=-number, points=2**40 + number, wall=7, left_out=number,
                       values=values)  # fmt: skip
        found = reader.decode(writer.encode(sent))
        assert (found.kind, found.t, found.points) == (Kind.VALUES, -number, 2**40 + number)
        assert (found.wall, found.left_out, found.document) == (7, number, None)
        assert found.values is not None
        assert list(found.values) == list(values)
        assert all(same(found.values[name], value) for name, value in values.items())


def test_a_value_that_stays_takes_sixteen_bytes() -> None:
    writer = Writer(schema_of(a__x=output(shape=(1000,))))
    kept = np.zeros(1000)
    sizes = [len(writer.encode(Message(kind=Kind.VALUES, values={"a.x": kept}))) for _ in range(3)]
    assert sizes == [HEADER.size + 16 + 32 + 8000, HEADER.size + 32, HEADER.size + 32]


def test_how_a_run_ended() -> None:
    writer, reader = Writer(schema_of()), Reader()
    reader.decode(writer.schema())
    said = {"status": "failed", "error": "component `a` at t = 1 s: \N{SNOWMAN}"}
    found = reader.decode(writer.encode(Message(kind=Kind.END, t=3, document=said)))
    assert (found.kind, found.t, found.document, found.values) == (Kind.END, 3, said, None)


def test_counts_that_have_no_room_stay_at_the_largest() -> None:
    writer, reader = Writer(schema_of()), Reader()
    reader.decode(writer.schema())
    lost = Message(kind=Kind.END, document={}, left_out=2**40)
    assert reader.decode(writer.encode(lost)).left_out == 2**32 - 1


GOOD = Writer(schema_of(a__x=output())).schema()


@pytest.mark.parametrize(
    ("raw", "complaint"),
    [
        (b"", "0 bytes are too short"),
        (GOOD[:47], "47 bytes are too short"),
        (b"NLOS" + GOOD[4:], "starts with b'NTAP', not b'NLOS'"),
        (GOOD[:4] + b"\2\0" + GOOD[6:], "speaks version 2, this is version 1"),
        (GOOD[:6] + b"\4\0" + GOOD[8:], "unknown kind 4"),
        (GOOD[:6] + b"\2\0" + GOOD[8:], "values came before what they are of"),
        (GOOD[:48] + b"[1]" + GOOD[51:], "cannot be read"),
        (GOOD.replace(b'"signals"', b'"signalz"'), "KeyError: 'signals'"),
        (GOOD.replace(b'"<f8"', b'"|O8"'), "is not an element type"),
    ],
)
def test_a_damaged_message_is_refused(raw: bytes, complaint: str) -> None:
    with pytest.raises(WireError, match=re.escape(complaint)):
        Reader().decode(raw)


@settings(max_examples=200)
@given(st.binary(max_size=120))
def test_garbage_is_never_more_than_an_error(tail: bytes) -> None:
    reader = Reader()
    reader.decode(GOOD)
    for raw in (tail, MAGIC + tail, HEADER.pack(MAGIC, 1, 2, 0, 0, 0, 0, 0) + tail):
        try:
            reader.decode(raw)
        except WireError:
            reader = Reader()
            reader.decode(GOOD)


def test_a_file_that_was_cut_off_has_the_messages_before() -> None:
    file = io.BytesIO()
    whole = [GOOD, Writer(schema_of()).schema()]
    for raw in whole:
        append(file, raw)
    content = file.getvalue()
    assert list(messages(io.BytesIO(content))) == whole
    for end in range(len(content)):
        found = list(messages(io.BytesIO(content[:end])))
        assert found == whole[: len(found)]
        assert len(found) == (end >= 8 + len(GOOD))
    with pytest.raises(WireError, match="a message of 0 bytes in a file"):
        list(messages(io.BytesIO(bytes(8))))


IN_JAVASCRIPT = """
function fromHex(text) {
  const bytes = new Uint8Array(text.length / 2);
  for (let i = 0; i < bytes.length; i += 1) bytes[i] = parseInt(text.substr(2 * i, 2), 16);
  return bytes.buffer;
}
function hexOf(data) {
  let text = "";
  for (const each of new Uint8Array(data.buffer, data.byteOffset, data.byteLength))
    text += each.toString(16).padStart(2, "0");
  return text;
}
function all(text) {
  const reader = new TapReader();
  const found = [];
  for (const raw of messagesOf(fromHex(text))) {
    const m = reader.read(raw);
    const values = {};
    for (const [name, value] of Object.entries(m.values || {}))
      values[name] = value.shape
        ? { shape: value.shape, kind: value.data.constructor.name, hex: hexOf(value.data) }
        : { hex: hexOf(value) };
    found.push({ ...m, t: String(m.t), wall: String(m.wall), values });
  }
  return JSON.stringify(found);
}
"""


def test_javascript_reads_every_value_as_python_does() -> None:
    """With the example of the manual, in V8, the engine of several browsers and of Node."""
    racer = pytest.importorskip("py_mini_racer", reason="mini-racer is not installed")
    rng = np.random.default_rng(5)
    outputs = {
        f"a__{number}": output(dtype=np.dtype(text), shape=("n", 2))
        for number, text in enumerate(TYPES)
    }
    schema = schema_of(
        **outputs, b__s=output(unit="m/s²"), b__raw=output(dtype=None), b__kept=output(shape=(3,))
    )
    kept, writer, file = rng.random(3), Writer(schema), io.BytesIO()
    append(file, writer.schema())
    for number in range(5):
        values: dict[str, Any] = {**own(number), "b.kept": kept, "b.raw": rng.bytes(number)}
        for name, text in (
            (n.replace("__", "."), str(np.dtype(c.dtype).str)) for n, c in outputs.items()
        ):
            raw = rng.bytes(np.dtype(text).itemsize * 2 * number)
            if text == "|b1":
                raw = bytes(byte & 1 for byte in raw)
            values[name] = np.frombuffer(raw, text).reshape(number, 2)
        values["b.s"] = np.array(rng.random(), np.float32)  # not of the declared type
        message = Message(kind=Kind.VALUES, t=-(2**62) + number, points=number, wall=2**60,
                          left_out=number, values=values)  # fmt: skip
        append(file, writer.encode(message))
    append(
        file, writer.encode(Message(kind=Kind.END, t=9, document={"status": "done \N{SNOWMAN}"}))
    )

    engine = racer.MiniRacer()
    engine.eval((ROOT / "docs" / "examples" / "tap_reader.js").read_text(encoding="utf-8"))
    engine.eval(IN_JAVASCRIPT)
    theirs = json.loads(engine.eval(f'all("{file.getvalue().hex()}")'))

    reader = Reader()
    file.seek(0)
    ours = [reader.decode(raw) for raw in messages(file)]
    assert len(ours) == len(theirs) == 7
    for mine, other in zip(ours, theirs, strict=True):
        assert other["kind"] == mine.kind.name.lower()
        assert (int(other["t"]), int(other["wall"])) == (mine.t, mine.wall)
        assert (other["points"], other["leftOut"]) == (mine.points, mine.left_out)
        assert other["document"] == mine.document
        named = mine.values or {}
        assert list(other["values"]) == list(named)
        for name, value in named.items():
            found = other["values"][name]
            if isinstance(value, bytes):
                assert found == {"hex": value.hex()}
            else:
                assert (found["hex"], found["shape"]) == (value.tobytes().hex(), list(value.shape))
    kinds = {name: value["kind"] for name, value in theirs[2]["values"].items() if "kind" in value}
    assert kinds["a.0"] == "Float64Array"
    assert kinds["a.2"] == "BigInt64Array"
    assert kinds["b.s"] == "Float32Array"
