"""The connectors of a component, as its host describes them."""

import dataclasses
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from orchestrator.absence import Need, Undriven
from orchestrator.meaning import Meaning
from orchestrator.remote.block import element_type
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Variability
from orchestrator.units import Unit


def connectors_to_message(
    connectors: Mapping[str, Connector], command: Message, document: Mapping[str, Any]
) -> bytes:
    """A reply to `command` that describes `connectors`; start values travel as signals.

    Args:
        connectors: by name.
        command: what is answered.
        document: what else the reply says.
    """
    described = {name: _describe(connector) for name, connector in connectors.items()}
    starts = {
        name: c.start if isinstance(c.start, bytes) else np.asarray(c.start, c.dtype)
        for name, c in connectors.items()
        if c.start is not None
    }
    reply = command.reply(Kind.DONE, {**document, "connectors": described})
    return reply.encode(SignalEncoder(connectors).parts(starts))


def connectors_from_message(
    document: Mapping[str, Any], message: bytes, offset: int
) -> dict[str, Connector]:
    """What `connectors_to_message` described."""
    without_starts = {name: _connector(d) for name, d in document["connectors"].items()}
    starts = SignalDecoder(without_starts).decode(message, offset)
    return {
        name: _connector(d, start=starts.get(name)) for name, d in document["connectors"].items()
    }


def _describe(connector: Connector) -> dict[str, Any]:
    return {
        "causality": connector.causality.value,
        # `str` rather than the name: it states the byte order
        "dtype": None if connector.is_binary else np.dtype(connector.dtype).str,
        "shape": list(connector.shape),
        "unit": connector.unit,
        "definition": _definition(connector.definition),
        "is_relative": connector.is_relative,
        "variability": connector.variability.value,
        "mime_type": connector.mime_type,
        "feedthrough": sorted(connector.feedthrough),
        "description": connector.description,
        "undriven": (u := connector.undriven) and [u.meaning, u.need.value, sorted(u.beside)],
        "parameter": list(connector.parameter),
        "meaning": None if connector.meaning is None else dataclasses.asdict(connector.meaning),
    }


def _connector(document: Mapping[str, Any], start: Any = None) -> Connector:
    return Connector(
        causality=Causality(document["causality"]),
        dtype=None if document["dtype"] is None else element_type(document["dtype"]),
        shape=tuple(document["shape"]),
        unit=document["unit"],
        definition=_unit(document["definition"]),
        is_relative=document["is_relative"],
        variability=Variability(document["variability"]),
        start=start,
        mime_type=document["mime_type"],
        feedthrough=frozenset(document["feedthrough"]),
        description=document["description"],
        undriven=None if (s := document["undriven"]) is None else _undriven(s),
        parameter=tuple(document["parameter"]),
        meaning=None if (said := document.get("meaning")) is None else _meaning(said),
    )


def _meaning(said: Mapping[str, Any]) -> Meaning:
    document = {**said}
    items = tuple((str(name), int(number)) for name, number in document.pop("items", ()))
    return Meaning(**document, items=items)


def _undriven(said: Sequence[Any]) -> Undriven:
    return Undriven(said[0], Need(said[1]), frozenset(said[2]))


def _definition(unit: Unit | None) -> dict[str, Any] | None:
    if unit is None:
        return None
    return {
        "symbol": unit.symbol,
        "factor": str(unit.factor),
        "exponents": list(unit.exponents),
        "offset": str(unit.offset),
    }


def _unit(document: Mapping[str, Any] | None) -> Unit | None:
    if document is None:
        return None
    return Unit(
        symbol=document["symbol"],
        factor=Fraction(document["factor"]),
        exponents=tuple(document["exponents"]),
        offset=Fraction(document["offset"]),
    )
