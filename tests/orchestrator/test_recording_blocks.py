"""Files of compressed blocks: nothing is lost, and what is damaged is said."""

import hashlib
import itertools
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import textwrap
import tracemalloc
import weakref
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

import orchestrator.recording.blocks
import orchestrator.recording.parts
from orchestrator.recording.blocks import scan
from orchestrator.recording.columns import compress
from orchestrator.recording.filters import Guesses, Records
from orchestrator.recording.layout import Files, RecordingError, plain_of
from orchestrator.recording.parts import BLOCK_BYTES, Latest, Part, Shared
from orchestrator.recording.reader import Recording
from orchestrator.recording.samples import times_part
from orchestrator.recording.stored import Stored, damage_of

DTYPES = st.one_of(
    hnp.boolean_dtypes(),
    hnp.integer_dtypes(endianness="="),
    hnp.unsigned_integer_dtypes(endianness="="),
    hnp.floating_dtypes(endianness="=", sizes=(16, 32, 64)),
    hnp.complex_number_dtypes(endianness="=", sizes=(64, 128)),
)


@st.composite
def chunks(draw: st.DrawFn) -> list[np.ndarray[Any, Any]]:
    """What is appended one by one: any number of rows of any shape and type, and any bits."""
    dtype, shape = draw(DTYPES), draw(hnp.array_shapes(min_dims=0, max_dims=2, min_side=0))
    counts = draw(st.lists(st.integers(0, 9), max_size=12))
    size = dtype.itemsize * int(np.prod(shape, dtype=np.int64))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    high = draw(st.sampled_from([2, 5, 256]))
    rows = [rng.integers(0, high, (n * size,), np.uint8).tobytes() for n in counts]
    return [np.ndarray((n, *shape), dtype, each) for n, each in zip(counts, rows, strict=True)]


@st.composite
def samples(draw: st.DrawFn) -> list[bytes]:
    """Samples of bytes, of any lengths or as messages are: a head and records."""
    if draw(st.booleans()):
        return draw(st.lists(st.binary(max_size=40), max_size=20))
    head, record = draw(st.integers(0, 16)), draw(st.sampled_from([1, 3, 4, 8, 56, 300]))
    counts = draw(st.lists(st.integers(0, 9), max_size=20))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    return [rng.integers(0, 9, head + n * record, np.uint8).tobytes() for n in counts]


def written(path: Path, rows: Sequence[Any], flushes: Sequence[bool], block: int) -> Part:
    """A part with `rows`, in blocks of `block` bytes, flushed after those with a true flush."""
    binary = not rows or isinstance(rows[0], bytes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(orchestrator.recording.parts, "BLOCK_BYTES", block)
        if binary:
            part = Part(path, "y.npy", np.dtype(np.uint8), samples=True)
        else:
            part = Part(path, "y.npy", rows[0].dtype, rows[0].shape[1:])
        for k, each in enumerate(rows):
            part.append(each if binary else each.tobytes(), len(each))
            if flushes[k % len(flushes)]:
                part.flush()
    return part


def content(rows: Sequence[Any]) -> bytes:
    return b"".join(each if isinstance(each, bytes) else each.tobytes() for each in rows)


def read(path: Path) -> np.ndarray[Any, Any]:
    stored = Stored.open(path)
    return stored[0 : len(stored)]


FLUSHES = st.lists(st.booleans(), min_size=1, max_size=8)


@settings(max_examples=150, deadline=None)
@given(rows=st.one_of(chunks(), samples()), flushes=FLUSHES, block=st.integers(1, 300))
def test_what_is_appended_is_read_however_it_is_split(
    rows: Sequence[Any], flushes: list[bool], block: int
) -> None:
    """Also before it is closed; and when it was flushed changes no byte of the file."""
    with tempfile.TemporaryDirectory() as folder:
        one, other = Path(folder, "one.zst"), Path(folder, "other.zst")
        part, plain = written(one, rows, flushes, block), written(other, rows, [False], block)
        if rows and flushes[(len(rows) - 1) % len(flushes)]:
            assert read(one).tobytes() == content(rows)
        part.close()
        plain.close()
        found = read(one)
        assert found.tobytes() == content(rows)
        assert len(found) == sum(map(len, rows))
        if rows and not isinstance(rows[0], bytes):
            assert (found.dtype, found.shape[1:]) == (rows[0].dtype, rows[0].shape[1:])
        assert part.digest == plain.digest
        assert part.digest.sha256 == hashlib.sha256(content(rows)).hexdigest()
        assert one.read_bytes() == other.read_bytes()
        assert part.size == one.stat().st_size
        assert [path.name for path in sorted(Path(folder).iterdir())] == ["one.zst", "other.zst"]
        assert damage_of(one, ended=True) == ()


@settings(max_examples=150, deadline=None)
@given(
    rows=st.one_of(chunks(), samples()), flushes=FLUSHES, block=st.integers(1, 300), data=st.data()
)
def test_how_much_arrives_at_once_does_not_show(
    rows: list[Any], flushes: list[bool], block: int, data: st.DataObject
) -> None:
    """The bytes on disk are those of rows, or samples, that were appended one by one."""
    binary = not rows or isinstance(rows[0], bytes)
    # of rows without bytes, lengths do not say how many there are
    by_sample = binary or (0 not in rows[0].shape[1:] and data.draw(st.booleans()))
    each = rows if by_sample else [one[k : k + 1] for one in rows for k in range(len(one))]
    cuts = data.draw(st.lists(st.integers(0, len(each)), max_size=6).map(sorted))
    at_once = [each[a:b] for a, b in itertools.pairwise([0, *cuts, len(each)])]
    dtype, shape = (np.dtype(np.uint8), ()) if binary else (rows[0].dtype, rows[0].shape[1:])
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(orchestrator.recording.parts, "BLOCK_BYTES", block)
        patch.setattr(orchestrator.recording.parts, "_SMALL", data.draw(st.integers(0, 40)))
        one, many = (
            Part(Path(folder) / name, "y.npy", dtype, shape, samples=binary) for name in ("1", "2")
        )
        for k, some in enumerate(at_once):
            for row in some:
                one.append(content([row]), len(row))
            if by_sample:
                many.append_samples(content(some), [len(content([row])) for row in some])
            else:
                is_kept = data.draw(st.booleans())
                many.append_rows(content(some), len(some), is_kept=is_kept)
            if flushes[k % len(flushes)]:
                one.flush()
                many.flush()
            files = {path.name: path.read_bytes() for path in Path(folder).iterdir()}
            assert len(files) in (2, 4)
            for name in [name for name in files if name.startswith("1")]:
                assert files[name] == files[f"2{name[1:]}"]
        one.close()
        many.close()
        assert (Path(folder) / "1").read_bytes() == (Path(folder) / "2").read_bytes()
        assert one.digest == many.digest


def test_rows_that_are_kept_are_not_copied_and_let_go_with_the_next_flush(tmp_path: Path) -> None:
    """Small ones are copied: the memory that they are in may be large."""
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype("<f8"))
    large, small, other = np.arange(512.0), np.arange(511.0), np.arange(600.0)
    left = [weakref.ref(large), weakref.ref(small), weakref.ref(other)]
    part.append_rows(large.data.cast("B"), len(large), is_kept=True)
    part.append_rows(small.data.cast("B"), len(small), is_kept=True)
    part.append_rows(other.data.cast("B"), len(other))
    wanted = np.concatenate([large, small, other])
    del large, small, other
    assert [each() is not None for each in left] == [True, False, False]
    part.flush()
    assert left[0]() is None
    part.close()
    assert (read(tmp_path / "y.zst") == wanted).all()


def test_rows_that_are_kept_are_flushed_once_each(tmp_path: Path) -> None:
    """Whatever of the same block was flushed before, and whatever was copied in between."""
    rows = np.arange(3000.0)
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype("<f8"))
    for start in range(0, 3000, 1000):
        part.append_rows(rows[start : start + 900].data.cast("B"), 900, is_kept=True)
        part.append_rows(rows[start + 900 : start + 1000].data.cast("B"), 100)
        part.flush()
        seen = rows[: start + 1000]
        assert (read(tmp_path / "y.zst") == seen).all()
        assert part.digest.sha256 == hashlib.sha256(seen.tobytes()).hexdigest()
    part.close()
    assert (read(tmp_path / "y.zst") == rows).all()
    assert part.digest.sha256 == hashlib.sha256(rows.tobytes()).hexdigest()


def test_a_part_that_is_closed_holds_no_rows(tmp_path: Path) -> None:
    """There may be hundreds of them, and a recording lives as long as its run is looked at."""
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype("<f8"))
    part.append_rows(np.arange(600.0).tobytes(), 600)
    buffer = weakref.ref(part._buffer)
    part.close()
    assert buffer() is None


SEVERAL = st.lists(
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 1), st.booleans()), max_size=8),
    min_size=2,
    max_size=4,
)
"""Of each part: how many numbers come at once, which ones, and whether they are flushed then."""


@settings(max_examples=300, deadline=None)
@given(several=SEVERAL, block=st.integers(1, 60), data=st.data())
def test_parts_that_may_share_blocks_are_what_they_are_alone(
    several: list[list[tuple[int, int, bool]]], block: int, data: st.DataObject
) -> None:
    """Whether their rows are equal throughout, for a while, or not; and whenever they come."""
    several[-1] = data.draw(st.sampled_from(several))
    shared = Shared()
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(orchestrator.recording.parts, "BLOCK_BYTES", block)
        patch.setattr(orchestrator.recording.parts, "_SMALL", 16)

        def part(name: str, latest: Latest | None) -> Part:
            return Part(Path(folder, name), "y.npy", np.dtype("<i8"), latest=latest, shared=shared)

        alike = [part(f"alike{k}", shared.times) for k in range(len(several))]
        alone = [part(f"alone{k}", None) for k in range(len(several))]
        for turn in range(8):
            for rows, *both in zip(several, alike, alone, strict=True):
                for count, value, is_flushed in rows[turn : turn + 1]:
                    for each in both:
                        rows_of = np.full(count, value, "<i8").tobytes()
                        each.append_rows(rows_of, count, is_kept=bool(value))
                        if is_flushed:
                            each.flush()
        for k, (one, other) in enumerate(zip(alike, alone, strict=True)):
            one.close()
            other.close()
            assert one.digest == other.digest
            assert one.size == other.size
            assert one.memory().keys() == other.memory().keys()
            assert str(one.memory()) == str(other.memory())
            assert Path(folder, f"alike{k}").read_bytes() == Path(folder, f"alone{k}").read_bytes()


def test_equal_times_are_compressed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three components, of which two publish at the same times."""
    shared = Shared()
    made: list[int] = []
    for name in "abc":
        (tmp_path / "signals" / name).mkdir(parents=True)
    parts = [times_part(Files(tmp_path, name, ""), shared) for name in "abc"]
    for part, step in zip(parts, (1, 1, 2), strict=True):
        part.append_rows(np.arange(0, 100 * step, step).tobytes(), 100)

    def counted(stream: Any) -> bytes:
        made.append(len(stream))
        return compress(stream)

    monkeypatch.setattr(orchestrator.recording.blocks, "compress", counted)
    for part in parts:
        part.close()
    assert len(made) == 2
    assert [read(tmp_path / "signals" / n / "time.zst")[99] for n in "abc"] == [99, 99, 198]


def test_many_rows_at_once_must_be_rows(tmp_path: Path) -> None:
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype(np.float64), (2,))
    with pytest.raises(ValueError, match=r"`y\.npy` was given 40 bytes, not 2 rows of 16 bytes"):
        part.append_rows(bytes(40), 2)
    wrong = "was given 40 bytes, not 2 samples of rows of 16 bytes"
    for lengths in ([16, 16], [20, 20], [56, -16]):
        with pytest.raises(ValueError, match=wrong):
            part.append_samples(bytes(40), lengths)
    empty = Part(tmp_path / "x.zst", "x.npy", np.dtype(np.float64), (0,))
    with pytest.raises(ValueError, match="was given 0 bytes, not 2 samples of rows of 0 bytes"):
        empty.append_samples(b"", [0, 0])
    binary = Part(tmp_path / "z.zst", "z.npy", np.dtype(np.uint8), samples=True)
    with pytest.raises(ValueError, match=r"`z\.npy` takes samples of bytes, not rows"):
        binary.append_rows(bytes(4), 4)


@settings(max_examples=60, deadline=None)
@given(rows=samples(), block=st.integers(1, 300), data=st.data())
def test_any_rows_can_be_asked_for(rows: list[bytes], block: int, data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        written(Path(folder, "y.zst"), rows, [True], block)
        stored = Stored.open(Path(folder, "y.zst"))
        assert len(stored) == len(content(rows))
        first = data.draw(st.integers(0, len(stored)))
        end = data.draw(st.integers(first, len(stored)))
        assert stored[first:end].tobytes() == content(rows)[first:end]
        assert b"".join(each.tobytes() for each in stored.blocks()) == content(rows)


BITS = st.one_of(
    st.sampled_from([0, 1 << 63, 0x7FF8 << 48, 0xFFF8 << 48, 1]), st.integers(0, 2**64 - 1)
)


@settings(max_examples=200, deadline=None)
@given(data=st.data(), n=st.integers(1, 30), common=BITS, addend=st.sampled_from([-1, 2]))
def test_a_wrong_guess_loses_nothing(data: st.DataObject, n: int, common: int, addend: int) -> None:
    def column(elements: st.SearchStrategy[int]) -> np.ndarray[Any, Any]:
        return np.array(data.draw(st.lists(elements, min_size=n, max_size=n)), np.uint64)

    ids = column(st.integers(0, 3)), column(st.integers(0, 3))
    base, value = column(BITS), column(BITS)
    constant = data.draw(st.floats(-1e3, 1e3))
    with np.errstate(all="ignore"):
        near = (base.view(np.float64) + constant).view(np.uint64) + column(st.integers(0, 9))
    value = np.where(column(st.integers(0, 1)).astype(bool), value, near)
    filter_ = Guesses(pair=(0, 1), addend=addend, constant=constant, common=common)
    streams = [np.asarray(each).tobytes() for each in filter_.encode(value, Records([*ids, base]))]
    again = filter_.decode(streams, np.dtype("<u8"), Records([*ids, base]))
    assert again.tolist() == value.tolist()


def links(n: int, seed: int = 0) -> np.ndarray[Any, Any]:
    """Frames between 40 radios: who, to whom, a loss that is the same back, and what is left."""
    rng = np.random.default_rng(seed)
    table = np.zeros(n, [("from", "<i8"), ("to", "<i8"), ("loss", "<f8"), ("rest", "<f8")])
    loss = rng.normal(80.0, 9.0, (40, 40))
    table["from"], table["to"] = rng.integers(0, 40, (2, n))
    table["loss"] = (loss + loss.T)[table["from"], table["to"]]
    table["rest"] = table["loss"] + 23.7
    table["rest"][rng.random(n) < 0.3] = np.nan
    return table


def test_what_follows_from_other_columns_costs_next_to_nothing(tmp_path: Path) -> None:
    """Two doubles of 52 random bits each in 32 bytes; both can be told from the rest."""
    table = links(40_000)
    rows = [b"head" + each.tobytes() for each in np.array_split(table, 99)]
    written(tmp_path / "y.zst", rows, [False], 1 << 20).close()
    assert read(tmp_path / "y.zst").tobytes() == content(rows)
    # ids 2 x log2(40) bits, NaN or not 0.9 bits, 820 losses that are new in each of two blocks:
    # 1.8 bytes; and one more for the coding
    assert (tmp_path / "y.zst").stat().st_size < 2.8 * len(table)


def blocks_of_three(path: Path) -> bytes:
    """A file with three blocks; what is in it."""
    rng = np.random.default_rng(1)
    rows = [b"head" + rng.integers(0, 2, 24 * n, np.uint8).tobytes() for n in (1, 2, 3, 4) * 2]
    written(path, rows, [False], 130).close()
    assert len(scan(path).blocks) == 3
    return content(rows)


@pytest.mark.slow
def test_a_file_that_is_cut_anywhere_is_read_up_to_there(tmp_path: Path) -> None:
    """Each block that is there from first to last byte is read; file and place are said."""
    path = tmp_path / "y.zst"
    rows = blocks_of_three(path)
    data, blocks = path.read_bytes(), scan(path).blocks
    for size in range(len(data)):
        path.write_bytes(data[:size])
        (said,) = damage_of(path, ended=True)
        assert str(path) in said
        assert "at byte" in said
        if size < blocks[0].offset:
            with pytest.raises(RecordingError, match="damaged at byte 0: no opening note"):
                Stored.open(path)
            continue
        assert f"byte {size}" in said
        assert damage_of(path, ended=False) == ()  # the run may have been killed then
        whole = [block for block in blocks if block.end <= size]
        assert read(path).tobytes() == rows[: sum(block.rows for block in whole)]


@pytest.mark.slow
def test_a_damaged_byte_is_said_and_the_rest_is_read(tmp_path: Path) -> None:
    """A bit of each byte is flipped. No other value is ever read instead of the recorded one."""
    path = tmp_path / "y.zst"
    rows = blocks_of_three(path)
    data, blocks = path.read_bytes(), scan(path).blocks
    unsaid = 0
    for at in range(len(data)):
        damaged = bytearray(data)
        damaged[at] ^= 1 << at % 8
        path.write_bytes(damaged)
        said = damage_of(path, ended=True)
        if not said:  # a bit without meaning
            unsaid += 1
            assert read(path).tobytes() == rows
            continue
        assert all(str(path) in each and "byte" in each for each in said)
        if at < blocks[0].offset:
            continue
        hit = next((b for b in blocks if b.offset <= at < b.end), None)
        stored = Stored.open(path)
        for block in blocks:
            first, end = block.first, block.first + block.rows
            if block is not hit:
                assert stored[first:end].tobytes() == rows[first:end]
                continue
            last = block is blocks[-1] and end > len(stored)
            if not last:
                with pytest.raises(RecordingError, match=rf"{path.name}` is damaged .*are lost"):
                    stored[first:end]
    assert unsaid <= 2 * sum(len(block.frames) for block in blocks)


def test_a_block_that_was_being_written_costs_nothing(tmp_path: Path) -> None:
    """Killed anywhere within it: what was flushed before is beside it."""
    path = tmp_path / "y.zst"
    rng = np.random.default_rng(2)
    rows = [rng.integers(0, 2, 12, np.uint8).tobytes() for _ in range(15)]
    part = written(path, rows, [True], 100)
    before, (tail,) = path.read_bytes(), tmp_path.glob("y+*.npy")
    flushed = tail.read_bytes()
    part.close()
    after = path.read_bytes()
    tail.write_bytes(flushed)
    for size in range(len(before), len(after) + 1):
        path.write_bytes(after[:size])
        assert read(path).tobytes() == content(rows)
        assert damage_of(path, ended=False) == ()


def test_a_tail_that_is_cut_anywhere_is_read_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / "y.zst"
    written(path, [np.arange(20)], [True], 1000)
    (tail,) = tmp_path.glob("y+*.npy")
    data = tail.read_bytes()
    assert np.load(tail).tolist() == list(range(20))
    for size in range(1, len(data)):
        tail.write_bytes(data[:size])
        there = max(size - 128, 0) // 8
        assert read(path).tolist() == list(range(there))
        (said,) = damage_of(path, ended=False)
        assert f"`{tail}`" in said


KILLED = """
    import sys
    from pathlib import Path
    import numpy as np
    import orchestrator.recording.parts
    import orchestrator.recording.recorder
    from orchestrator import Causality, Connector, Jacobi, Recorder, System, simulate
    from orchestrator.testing import FunctionComponent

    orchestrator.recording.parts.BLOCK_BYTES = 20_000
    orchestrator.recording.recorder.FLUSH_INTERVAL = -1.0  # at the first point, too
    connectors = {"y": Connector(causality=Causality.OUTPUT, shape=(50,)),
                  "packets": Connector(causality=Causality.OUTPUT, dtype=None)}

    def function(state, inputs, t):
        print(t // 10 - 1, flush=True)  # the sample before is flushed
        rng = np.random.default_rng(t // 10)
        return None, {"y": rng.random(50), "packets": rng.bytes(16 + 56 * (t // 10 % 9))}

    system = System({"a": FunctionComponent(connectors, function)}, {"a": 10}, [])
    simulate(system, Jacobi(), start=0, stop=10**9, seed=0, observers=[Recorder(Path(sys.argv[1]))])
"""


@pytest.mark.parametrize("lines", [1, 60, 173, 400, 777])
def test_a_killed_run_is_readable_up_to_the_last_communication_point(
    tmp_path: Path, lines: int
) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-c", textwrap.dedent(KILLED), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as process:
        assert process.stdout is not None
        for _ in range(lines):
            process.stdout.readline()
        process.send_signal(signal.SIGKILL)
        told = [int(line) for line in process.stdout.read().split()] or [lines - 2]
    recording = Recording(tmp_path)
    assert recording.manifest["status"] == "running"
    y, packets = recording["a.y"], recording["a.packets"]
    assert min(len(y), len(packets)) >= told[-1] + 1
    for k in range(min(len(y), len(packets))):
        rng = np.random.default_rng(k)
        assert np.array_equal(np.asarray(y[k]), rng.random(50))
        assert packets[k] == rng.bytes(16 + 56 * (k % 9))


def test_recordings_of_earlier_releases_are_read(tmp_path: Path) -> None:
    """One `.npy` file per part, uncompressed."""
    part = tmp_path / "y.zst"
    np.save(plain_of(part), np.arange(6.0).reshape(3, 2))
    assert read(part).tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
    assert damage_of(part, ended=True) == ()


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    part = tmp_path / "y.zst"
    with pytest.raises(RecordingError, match=r"y.zst` is missing"):
        Stored.open(part)
    written(part, [np.arange(3)], [False], 1000).close()
    newer = part.read_bytes()
    text = newer[12 : newer.index(b"}") + 1].replace(b'"nlosim":1', b'"nlosim":2')
    head = struct.pack("<4sII", newer[:4], len(text) + 4, zlib.crc32(text))
    part.write_bytes(head + text + newer[12 + len(text) :])
    with pytest.raises(RecordingError, match="has version 2; this release reads 1"):
        Stored.open(part)


def test_what_is_flushed_takes_no_memory_until_its_block_is_full(tmp_path: Path) -> None:
    """However slowly a signal grows, and whatever others do: blocks are made in one place."""
    shared = Shared()
    names = [f"{k}" for k in range(8)]
    dtype, rng = np.dtype("<f8"), np.random.default_rng(1)
    parts = [Part(tmp_path / f"{n}.zst", f"{n}.npy", dtype, shared=shared) for n in names]
    chunks = [rng.normal(size=1000) for _ in range(700)]  # 5.6 MB: more than a block
    tracemalloc.start()
    for k, chunk in enumerate(chunks):
        for part in parts:
            part.append_rows(chunk.tobytes(), 1000)
            part.flush()
        if k == 400:
            before = tracemalloc.get_traced_memory()[0]
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert before < 1_000_000  # 3.2 MB of each part are on disk
    assert after < 2.5 * BLOCK_BYTES  # 1.4 MB, and the room of one block, which was that of eight
    for part, name in zip(parts, names, strict=True):
        part.close()
        stored = Stored.open(tmp_path / f"{name}.zst")
        assert np.array_equal(stored[0 : len(stored)], np.concatenate(chunks))
        assert len(list(stored.blocks())) == 2
        assert part.digest.sha256 == hashlib.sha256(np.concatenate(chunks).tobytes()).hexdigest()


@pytest.mark.parametrize("is_cut", [False, True])
def test_rows_that_somebody_took_away_are_missed(tmp_path: Path, *, is_cut: bool) -> None:
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype("<f8"))
    part.append_rows(np.arange(9.0).tobytes(), 9)
    part.flush()
    (tail,) = tmp_path.glob("*+*.npy")
    part.append_rows(np.arange(9.0).tobytes(), 9)
    os.truncate(tail, 150) if is_cut else tail.unlink()
    with pytest.raises(OSError, match=rf"{re.escape(tail.name)}") as found:
        part.close()
    assert found.value.filename == str(tail)


def test_samples_without_bytes_take_no_memory(tmp_path: Path) -> None:
    """Nobody says anything, for weeks; how many there were is counted elsewhere."""
    part = Part(tmp_path / "y.zst", "y.npy", np.dtype(np.uint8), samples=True)
    tracemalloc.start()
    for _ in range(100_000):
        part.append(b"", 0)
    part.append_samples(b"", np.zeros(100_000, np.int64))
    assert tracemalloc.get_traced_memory()[0] < 10_000
    tracemalloc.stop()
    part.close()
    assert len(Stored.open(tmp_path / "y.zst")) == 0


def test_a_damaged_length_asks_for_no_memory(tmp_path: Path) -> None:
    """It may say 4 GB; the file has a few bytes."""
    path = tmp_path / "y.zst"
    part = Part(path, "y.npy", np.dtype("<f8"))
    part.append(np.arange(3.0).tobytes(), 3)
    part.close()
    content = path.read_bytes()
    second = content.index(content[:4], 4)
    path.write_bytes(content[: second + 4] + b"\xff\xff\xff\xff" + content[second + 8 :])
    tracemalloc.start()
    assert scan(path).damage
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000
