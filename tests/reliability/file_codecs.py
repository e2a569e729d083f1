"""What is read from files: recordings, traces, tables, networks, samples, journals."""

import importlib
import io
import json
import random
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from safetensors.numpy import load, save

from adapters.replay.findings import TrafficFileError
from adapters.tables.content import read as read_content
from fmus.channel.stand_ins.table import TableError
from fmus.channel.stand_ins.trace_file import read_names, read_trace
from fmus.driving.network.checkpoint import SHIPPED, read_network
from orchestrator.campaign.journal import read_lines
from orchestrator.errors import ComponentTypeError, ScenarioError
from orchestrator.hosts_file import read_hosts
from orchestrator.recording.blocks import BlockFile
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.stored import Stored
from studies.training.samples import read_samples, write_samples
from tests.adapters.traces import Sample, replay, write_csv, write_fcd
from tests.reliability.byte_mutations import mutated_bytes, mutated_document
from tests.reliability.codecs import Codec, of_file
from tests.reliability.yaml_mutations import WAYS, mutated, odd_value

_CELLS: Final = ("", " ", "nan", "inf", "-inf", "1e400", "-1", "0", "1e18", "9" * 30, "x", '"', "'",
                 '"a,b"', "é", "\0", "1,5", "1;5", "2026-11-24", "<a/>", "&amp;", "&lol;", "True",
                 "0x10", "1_0", " 1 ", "1e-320", "-0.0", "a" * 5000)  # fmt: skip


def _samples(rng: random.Random) -> list[Sample]:
    return [
        Sample(id=f"v{i}", time=float(t), x=10.0 * t, y=float(i), speed=rng.random() * 9)
        for t in range(rng.randrange(1, 6))
        for i in range(rng.randrange(1, 4))
    ]


def _mutated_text(content: bytes, rng: random.Random) -> bytes:
    """Bytes, or cells and lines, are changed."""
    if rng.random() < 0.4:
        return mutated_bytes(content, rng)
    lines = [line.split(b",") for line in content.split(b"\n")]
    for _ in range(rng.choice((1, 1, 2, 4))):
        line = rng.choice(lines)
        match rng.randrange(5):
            case 0 | 1:
                line[rng.randrange(len(line))] = rng.choice(_CELLS).encode()
            case 2:
                line.insert(rng.randrange(len(line) + 1), rng.choice(line))
            case 3 if len(line) > 1:
                del line[rng.randrange(len(line))]
            case _:
                lines.insert(rng.randrange(len(lines) + 1), rng.choice(lines))
    return b"\n".join(b",".join(line) for line in lines)


def _mutated_xml(content: bytes, rng: random.Random) -> bytes:
    """Bytes or values of attributes are changed, or elements repeated and removed."""
    if rng.random() < 0.4:
        return mutated_bytes(content, rng)
    parts = content.split(b'"')
    for _ in range(rng.choice((1, 1, 2, 4))):
        place = rng.randrange(len(parts))
        if place % 2:
            parts[place] = rng.choice(_CELLS).encode()
        elif len(parts) > 5:
            del parts[place : place + rng.choice((1, 2, 4))]
    return b'"'.join(parts)


def _pyarrow() -> Any:
    return importlib.import_module("pyarrow")


def _parquet(columns: dict[str, Any]) -> bytes:
    """A file of these columns; those that do not fit become text."""
    parquet = importlib.import_module("pyarrow.parquet")
    try:
        buffer = io.BytesIO()
        parquet.write_table(_pyarrow().table(columns), buffer)
    except (ValueError, TypeError, OverflowError, _pyarrow().ArrowException):
        buffer = io.BytesIO()
        texts = {str(k)[:99]: [str(x) for x in v] for k, v in columns.items()}
        parquet.write_table(_pyarrow().table(texts), buffer)
    return buffer.getvalue()


def _read_columns(content: bytes) -> dict[str, Any]:
    parquet = importlib.import_module("pyarrow.parquet")
    found: dict[str, Any] = parquet.read_table(io.BytesIO(content)).to_pydict()
    return found


def _mutated_parquet(content: bytes, rng: random.Random) -> bytes:
    """Bytes are changed, or cells and types of columns: lists, records, nothing, times."""
    if rng.random() < 0.5:
        return mutated_bytes(content, rng)
    columns = _read_columns(content)
    name = rng.choice([*columns])
    cells = columns[name]
    count = len(cells)
    some = rng.randrange(count) if count else 0
    ways: tuple[Callable[[], Any], ...] = (
        lambda: [[cell] for cell in cells],
        lambda: [{"a": cell} for cell in cells],
        lambda: [None] * count,
        lambda: [str(cell) for cell in cells],
        lambda: [bool(cell) for cell in cells],
        lambda: [str(cell).encode() for cell in cells],
        lambda: [*cells[:some], None, *cells[some + 1 :]],
        lambda: [
            *cells[:some],
            rng.choice((float("nan"), float("inf"), -1e300)),
            *cells[some + 1 :],
        ],
        lambda: np.arange(count).astype("datetime64[ns]"),
        lambda: [odd_value(rng)] * count,
    )
    columns[name] = rng.choice(ways)()
    if rng.random() < 0.1:
        del columns[name]
    return _parquet(columns)


def _table(rng: random.Random) -> bytes:
    lines = ["time [s],x [m],y"]
    lines += [f"{t / 10},{rng.random()},{t}" for t in range(rng.randrange(1, 9))]
    return "\n".join([*lines, ""]).encode()


def _links(rng: random.Random) -> dict[str, Any]:
    count = rng.randrange(1, 6)
    columns: dict[str, Any] = {
        "time": [0.1 * i for i in range(count)],
        "transmitter": [1] * count,
        "receiver": [2] * count,
    }
    if rng.random() < 0.5:
        return columns | {"per": [rng.random() for _ in range(count)]}
    return columns | {"outcome": ["R"] * count, "delay": [0.001] * count}


def _csv(columns: dict[str, Any]) -> bytes:
    rows = [[*columns], *zip(*columns.values(), strict=True)]
    return "\n".join([",".join(map(str, row)) for row in rows] + [""]).encode()


def _read_content(path: Path) -> Any:
    content, problems = read_content(path, "time")
    if (content is None) != bool(problems):
        raise AssertionError("neither a table nor a problem")
    return content


def _read_recorded(path: Path) -> list[bytes]:
    stored = Stored.open(path)
    return [block.tobytes() for block in stored.blocks()]


def _journal(rng: random.Random) -> bytes:
    lines = []
    for i in range(rng.randrange(1, 6)):
        text = json.dumps({"seed": i, "metrics": {"a": rng.random()}})
        checksum = zlib.crc32(text.encode())
        lines.append(json.dumps({**json.loads(text), "crc32": checksum}))
    return "\n".join([*lines, ""]).encode()


_HOSTS: Final = b"""\
hosts:
  a: {endpoint: "tcp/192.0.2.1:7447", insecure: true}
  b: {endpoint: "tcp/[::1]:7448"}
"""


def file_codecs(folder: Path) -> list[Codec]:
    """All of them; files are made in `folder`."""

    def written(suffix: str, write: Callable[[Path], Any]) -> bytes:
        path = folder / f"valid{suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        write(path)
        return path.read_bytes()

    def blocks(rng: random.Random) -> bytes:
        def write(path: Path) -> None:
            file = BlockFile(path, np.dtype("<f8"), (2,), None)
            for _ in range(rng.randrange(1, 4)):
                rows = rng.randrange(1, 9)
                file.append(rng.randbytes(16 * rows), rows, [])
            file.end()

        return written(".zst", write)

    def samples(rng: random.Random) -> bytes:
        contents = [rng.randbytes(rng.randrange(30)) for _ in range(3)]
        return written(".npz", lambda path: write_samples(path, contents))

    def network(rng: random.Random) -> bytes:
        del rng
        return min(SHIPPED.glob("*.safetensors"), key=lambda path: path.stat().st_size).read_bytes()

    def mutated_network(content: bytes, rng: random.Random) -> bytes:
        length = int.from_bytes(content[:8], "little")
        head = json.loads(content[8 : 8 + length])
        match rng.randrange(3):
            case 0:
                few = bytearray(mutated_bytes(content[: 8 + length], rng))
                return bytes(few) + content[8 + length :]
            case 1:
                said = json.loads(head["__metadata__"]["nlosim"])
                text = mutated_document(said, rng).decode(errors="replace")
                return save(load(content), metadata={"nlosim": text})
        text_ = mutated_document(head, rng)
        return len(text_).to_bytes(8, "little") + text_ + content[8 + length :]

    def traffic(path: Path) -> Any:
        return list(replay(path)._source.frames())

    declared = (TrafficFileError, ComponentTypeError)
    return [
        Codec(
            name="recorded signals",
            valid=blocks,
            decode=of_file(".zst", _read_recorded, folder),
            errors=(RecordingError,),
        ),
        Codec(
            name="traffic: SUMO's FCD",
            valid=lambda rng: written(".xml", lambda path: write_fcd(path, _samples(rng))),
            decode=of_file(".xml", traffic, folder),
            errors=declared,
            mutate=_mutated_xml,
        ),
        Codec(
            name="traffic: CSV",
            valid=lambda rng: written(".csv", lambda path: write_csv(path, _samples(rng))),
            decode=of_file(".csv", traffic, folder),
            errors=declared,
            mutate=_mutated_text,
        ),
        Codec(
            name="traffic: Parquet",
            valid=lambda rng: _parquet(_columns(_samples(rng))),
            decode=of_file(".parquet", traffic, folder),
            errors=declared,
            mutate=_mutated_parquet,
        ),
        Codec(
            name="tables: CSV",
            valid=_table,
            decode=of_file(".csv", _read_content, folder),
            mutate=_mutated_text,
        ),
        Codec(
            name="tables: Parquet",
            valid=lambda rng: _parquet(
                {"time [s]": [0.0, 0.1, 0.2], "x [m]": [rng.random()] * 3, "y": [1, 2, 3]}
            ),
            decode=of_file(".parquet", _read_content, folder),
            mutate=_mutated_parquet,
        ),
        Codec(
            name="links: CSV",
            valid=lambda rng: _csv(_links(rng)),
            decode=of_file(".csv", lambda path: read_trace(path, {}, 0), folder),
            errors=(TableError,),
            mutate=_mutated_text,
        ),
        Codec(
            name="links: Parquet",
            valid=lambda rng: _parquet(_links(rng)),
            decode=of_file(".parquet", lambda path: read_trace(path, {}, 0), folder),
            errors=(TableError, ComponentTypeError),
            mutate=_mutated_parquet,
        ),
        Codec(
            name="names of vehicles: CSV",
            valid=lambda rng: _csv({"name": ["a", "b"], "id": [1, rng.randrange(9)]}),
            decode=of_file(".csv", read_names, folder),
            errors=(TableError,),
            mutate=_mutated_text,
        ),
        Codec(
            name="networks",
            valid=network,
            decode=of_file(".safetensors", lambda path: read_network(str(path)), folder),
            errors=(ComponentTypeError,),
            mutate=mutated_network,
        ),
        Codec(
            name="samples of training",
            valid=samples,
            decode=of_file(".npz", read_samples, folder),
            errors=(RecordingError,),
        ),
        Codec(
            name="journals",
            valid=_journal,
            decode=of_file(".jsonl", lambda path: read_lines(path).contents, folder),
            mutate=mutated_bytes,
        ),
        Codec(
            name="hosts files",
            valid=lambda rng: _HOSTS,
            decode=of_file(".yaml", lambda path: read_hosts(path).path, folder),
            errors=(ScenarioError,),
            mutate=lambda content, rng: mutated(content, rng.choice(WAYS), rng),
        ),
    ]


def _columns(samples: list[Sample]) -> dict[str, Any]:
    names = ("id", "time", "x", "y", "heading", "speed", "type")
    return {name: [getattr(sample, name) for sample in samples] for name in names}
