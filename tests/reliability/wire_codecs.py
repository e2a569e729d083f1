"""What travels between processes and hosts of a run, to its readers, and into checkpoints."""

import io
import json
import random
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from adapters.zenoh.hosts import _agreed, _read, _RefusedError
from orchestrator.capabilities import EndRequest
from orchestrator.course import Course
from orchestrator.errors import ComponentTypeError
from orchestrator.packing import PackingError, packed, unpacked
from orchestrator.remote.block import WireError, entries, replaced
from orchestrator.remote.courses import (
    courses_from_document,
    courses_to_document,
    slopes_from_document,
    slopes_to_document,
)
from orchestrator.remote.declarations import connectors_from_message, connectors_to_message
from orchestrator.remote.ending import request_from_document, request_to_document
from orchestrator.remote.protocol import (
    Kind,
    Message,
    generator_from_document,
    generator_to_document,
    grid_from_document,
    grid_to_document,
)
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.resuming.files import CheckpointError, read_checkpoint, write_checkpoint
from orchestrator.signal import Causality, Connector, Signal, Variability
from orchestrator.statement import Statement
from orchestrator.tap import stream
from orchestrator.timebase import CommunicationGrid
from tests.reliability.byte_mutations import mutated_bytes, mutated_document
from tests.reliability.codecs import Codec, mutate_document, of_document, of_file

MALFORMED: Final = (LookupError, TypeError, ValueError, AttributeError)
"""What reading a document may raise within `Dialogue.reading`, and in a host, which answers."""

_TYPES: Final = ("<f8", "<f4", "|b1", "<i8", "|u1", ">i4", "<U3", "<M8[ns]", "<c16")


def array(rng: random.Random) -> "np.ndarray[Any, Any]":
    """Of any type, rank and bits that can travel."""
    dtype = np.dtype(rng.choice(_TYPES))
    shape = tuple(rng.randrange(4) for _ in range(rng.randrange(4)))
    size = int(np.prod(shape)) * dtype.itemsize
    content = bytes(size) if dtype.kind in "bU" else rng.randbytes(size)
    return np.frombuffer(content, dtype).reshape(shape)


def _signals(rng: random.Random) -> tuple[dict[str, Connector], dict[str, Signal]]:
    values: dict[str, Signal] = {}
    for i in range(rng.randrange(1, 5)):
        values[f"s{i}"] = rng.randbytes(rng.randrange(40)) if rng.random() < 0.3 else array(rng)
    connectors = {
        name: Connector(
            causality=Causality.OUTPUT,
            dtype=None if isinstance(value, bytes) else rng.choice((value.dtype, np.dtype("<f8"))),
        )
        for name, value in values.items()
    }
    return connectors, values


_CONNECTORS: Final = {
    "a": Connector(causality=Causality.OUTPUT, dtype="<f8"),
    "b": Connector(causality=Causality.OUTPUT, dtype=None),
    "c": Connector(causality=Causality.OUTPUT, dtype="|b1"),
    "d": Connector(causality=Causality.OUTPUT, dtype="<f4"),
}


def _block(rng: random.Random) -> bytes:
    values: dict[str, Signal] = {}
    for name, connector in _CONNECTORS.items():
        if rng.random() < 0.8:
            binary = rng.randbytes(rng.randrange(30))
            values[name] = binary if connector.is_binary else array(rng)
    return b"".join(SignalEncoder(_CONNECTORS).parts(values))


def _document(rng: random.Random) -> dict[str, Any]:
    return {
        "name": "x" * rng.randrange(9),
        "list": [1, 2.5, None, True],
        "of": {"a": {"b": ["c"]}, "z": -1},
    }


def _message(rng: random.Random) -> bytes:
    document = _document(rng) if rng.random() < 0.8 else {}
    kind = rng.choice([*Kind])
    whole = Message(kind, rng.randrange(9), rng.randrange(99), 10**9, 10**7, document)
    return whole.encode()


def _mutated_message(content: bytes, rng: random.Random) -> bytes:
    """A message whose frame is right again, often, about another document."""
    if rng.random() < 0.5:
        return mutated_bytes(content, rng)
    message, offset = Message.decode(content)
    text = mutated_document(dict(message.document), rng)
    header = bytearray(content[: len(Message(message.kind, 0, 0).encode())])
    header[12:16] = len(text).to_bytes(4, "little")
    return bytes(header) + text + bytes(-len(text) % 16) + content[offset:]


def _connector_reply(rng: random.Random) -> bytes:
    values = _signals(rng)[1]
    connectors = {
        name: Connector(
            causality=rng.choice((Causality.INPUT, Causality.OUTPUT)),
            dtype=None if isinstance(value, bytes) else value.dtype,
            shape=() if isinstance(value, bytes) else value.shape,
            unit="1" if isinstance(value, bytes) else rng.choice(("1", "m", "km/h", "dBm")),
            variability=Variability.CONTINUOUS
            if isinstance(value, np.ndarray) and value.dtype.kind == "f"
            else Variability.DISCRETE,
            start=value,
        )
        for name, value in values.items()
    }
    return connectors_to_message(connectors, Message(Kind.CREATE, 1, 1), {})


def _read_connectors(content: bytes) -> Mapping[str, Connector]:
    message, offset = Message.decode(content)
    return connectors_from_message(message.document, content, offset)


def _spec(rng: random.Random) -> Any:
    values = {"a": 1, "b": Path("/x"), "c": (1, 2.5, "x"), "d": [None, True], "e": rng.random()}
    return ComponentSpec(name="n", type=rng.choice(("lidar", Path("/a.fmu"))), values=values)


def _course(rng: random.Random) -> Course:
    shape = (rng.randrange(3),)
    return Course(tuple(np.full(shape, rng.random()) for _ in range(rng.randrange(1, 4))))


def _read_statement(content: bytes) -> Statement:
    document = _read(content)
    if document is None:
        raise WireError("whoever reads it looks at that before")
    return Statement.from_document(document)


_HERE: Final = Statement(nlosim="0.1", wire=3, scenario={}, entry={})


def _read_answer(content: bytes) -> Statement | None:
    answer = _read(content)
    return None if answer is None else _agreed("host", _HERE, answer)


_SAID: Final = {"statement": _HERE.to_document()}
_OTHERS: Final = ({"refused": ["other release"]}, {"wait": "in use"}, {"serves": ["a", "b"]})


def _mutated_answer(content: bytes, rng: random.Random) -> bytes:
    """The answer of a host that is there, or that has something to say."""
    whole = json.loads(content) if rng.random() < 0.5 else {**_SAID, **rng.choice(_OTHERS)}
    return mutated_document(whole, rng)


def _tap(rng: random.Random) -> bytes:
    connectors, values = _signals(rng)
    schema = stream.Schema.of("run", (0, 10**9), ["a", "b"], connectors)
    writer = stream.Writer(schema)
    buffer = io.BytesIO()
    for _ in range(2):
        stream.append(buffer, writer.encode(stream.Message(kind=stream.Kind.VALUES, values=values)))
    return b"".join((_lengthed(writer.schema()), buffer.getvalue()))


def _lengthed(raw: bytes) -> bytes:
    buffer = io.BytesIO()
    stream.append(buffer, raw)
    return buffer.getvalue()


def _read_tap(content: bytes) -> list[stream.Message]:
    reader = stream.Reader()
    return [reader.decode(raw) for raw in stream.messages(io.BytesIO(content))]


def _anything(rng: random.Random, depth: int = 0) -> Any:
    def several() -> int:
        return rng.randrange(4 if depth < 3 else 1)

    ways: tuple[Callable[[], Any], ...] = (
        lambda: rng.choice((None, True, False, "text")),
        lambda: rng.randrange(-(2**40), 2**40),
        rng.random,
        lambda: rng.randbytes(rng.randrange(20)),
        lambda: array(rng),
        lambda: [_anything(rng, depth + 1) for _ in range(several())],
        lambda: {f"k{i}": _anything(rng, depth + 1) for i in range(several())},
    )
    return rng.choice(ways)()


def _mutated_packed(content: bytes, rng: random.Random) -> bytes:
    """Packed values whose document is changed, and its length right again, often."""
    if rng.random() < 0.4:
        return mutated_bytes(content, rng)
    length = int.from_bytes(content[:8], "little")
    document = mutated_document(json.loads(content[8 : 8 + length]), rng)
    return len(document).to_bytes(8, "little") + document + content[8 + length :]


def _read_replaced(content: bytes) -> bytes:
    return replaced(b"", 0, [*entries(content, 0)])


def wire_codecs(folder: Path) -> list[Codec]:
    """Those of processes, hosts and readers; files are made in `folder`."""

    def checkpoint(rng: random.Random) -> bytes:
        (folder / "run" / "checkpoints").mkdir(parents=True, exist_ok=True)
        write_checkpoint(folder / "run", 5, {"value": _anything(rng)})
        return (folder / "run" / "checkpoints" / "5.state").read_bytes()

    return [
        Codec(
            name="signals on the wire",
            valid=_block,
            decode=lambda m: SignalDecoder(_CONNECTORS).decode(m),
            encode=lambda v: b"".join(SignalEncoder(_CONNECTORS).parts(v)),
            errors=(WireError,),
        ),
        Codec(
            name="signals on the wire, kept on a shelf",
            valid=_block,
            decode=_read_replaced,
            errors=(WireError,),
        ),
        Codec(
            name="messages of a component in another process",
            valid=_message,
            decode=lambda m: Message.decode(m)[0],
            encode=lambda v: v.encode(),
            errors=(WireError,),
            mutate=_mutated_message,
        ),
        Codec(
            name="descriptions of connectors",
            valid=_connector_reply,
            decode=_read_connectors,
            encode=lambda v: connectors_to_message(v, Message(Kind.CREATE, 1, 1), {}),
            errors=(WireError, *MALFORMED),
            mutate=_mutated_message,
        ),
        Codec(
            name="what to create",
            valid=of_document(lambda rng: _spec(rng).to_document()),
            decode=lambda m: ComponentSpec.from_document(json.loads(m)),
            errors=(ComponentTypeError, RecursionError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="random streams",
            valid=of_document(
                lambda rng: generator_to_document(np.random.default_rng(rng.randrange(2**60)))
            ),
            decode=lambda m: generator_to_document(generator_from_document(json.loads(m))),
            errors=(WireError, RecursionError, OverflowError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="communication points",
            valid=of_document(
                lambda rng: grid_to_document(CommunicationGrid(0, 10**7, rng.randrange(1, 9)))
            ),
            decode=lambda m: grid_from_document(json.loads(m)),
            encode=lambda v: json.dumps(grid_to_document(v)).encode(),
            errors=(RecursionError, ArithmeticError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="courses of inputs",
            valid=of_document(
                lambda rng: courses_to_document({f"x{i}": _course(rng) for i in range(2)})
            ),
            decode=lambda m: courses_from_document(json.loads(m)),
            encode=lambda v: json.dumps(courses_to_document(v)).encode(),
            errors=(WireError, RecursionError, OverflowError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="slopes of outputs",
            valid=of_document(lambda rng: slopes_to_document({"x": np.array([rng.random()])})),
            decode=lambda m: slopes_from_document(json.loads(m)),
            encode=lambda v: json.dumps(slopes_to_document(v)).encode(),
            errors=(WireError, RecursionError, OverflowError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="requests for the end of a run",
            valid=of_document(
                lambda rng: request_to_document(EndRequest(time=rng.randrange(9), why="x"))
            ),
            decode=lambda m: request_from_document(json.loads(m)),
            errors=(RecursionError, *MALFORMED),
            mutate=mutate_document,
        ),
        Codec(
            name="statements of hosts",
            valid=of_document(
                lambda rng: {
                    "nlosim": "0.1",
                    "wire": rng.randrange(9),
                    "scenario": {"a": "1"},
                    "entry": {"b": "2"},
                    "files": rng.choice((None, {"c": "3"})),
                    "connectors": {"d": "m"},
                }
            ),
            decode=_read_statement,
            encode=lambda v: json.dumps(v.to_document()).encode(),
            errors=(WireError,),
            mutate=mutate_document,
        ),
        Codec(
            name="answers of hosts",
            valid=of_document(lambda rng: {**_SAID, "accepted": True, "serving": "a"}),
            decode=_read_answer,
            errors=(_RefusedError,),
            mutate=_mutated_answer,
        ),
        Codec(
            name="what a tap sends",
            valid=_tap,
            decode=_read_tap,
            errors=(WireError,),
        ),
        Codec(
            name="packed values",
            valid=lambda rng: packed(_anything(rng)),
            decode=unpacked,
            encode=packed,
            errors=(PackingError,),
            mutate=_mutated_packed,
        ),
        Codec(
            name="checkpoints of runs",
            valid=checkpoint,
            decode=of_file(".state", read_checkpoint, folder),
            errors=(CheckpointError,),
            mutate=mutated_bytes,
        ),
    ]
