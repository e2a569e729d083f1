"""Entries of `connections`: sources, sums and constants, and what happens on the way."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

from orchestrator.scenario.document import Address
from orchestrator.scenario.model import ConnectionUse, ConstantUse
from orchestrator.scenario.schema import ConnectionEntry, Way
from orchestrator.transformation import Transformation

Routes: TypeAlias = tuple[tuple[ConnectionUse, ...], tuple[ConstantUse, ...]]

_WAYS: Final = tuple(Way.model_fields)
_SOURCES: Final = ("from", "sum", "value")


def read(entries: Sequence[ConnectionEntry]) -> Routes:
    """The connections of a file, one for each term of a sum, and its constants."""
    connections: list[ConnectionUse] = []
    constants: list[ConstantUse] = []
    for k, entry in enumerate(entries):
        address: Address = ("connections", k)
        if entry.source is not None:
            connections.append(
                ConnectionUse(entry.source, entry.target, _way(entry, adds=False), address)
            )
        for n, term in enumerate(entry.terms or ()):
            way, where = _way(term, adds=n > 0), (*address, "sum", n)
            connections.append(ConnectionUse(term.source, entry.target, way, where))
        if entry.source is None and entry.terms is None:
            constants.append(ConstantUse(entry.value, entry.target, address))
    return tuple(connections), tuple(constants)


def ends(entry: ConnectionEntry) -> Iterator[tuple[Address, str]]:
    """The texts of an entry that name components, with their addresses in it."""
    if entry.source is not None:
        yield ("from",), entry.source
    for n, term in enumerate(entry.terms or ()):
        yield ("sum", n, "from"), term.source
    yield ("to",), entry.target


def problems(entry: Mapping[str, Any]) -> Iterator[tuple[Address, str]]:
    """What is wrong with the keys of an entry as it is written, with addresses in it."""
    said = [key for key in _SOURCES if entry.get(key) is not None]
    if not said:
        yield (), "`from` is missing (an output), or `sum` (of outputs), or `value` (a constant)"
    elif len(said) > 1:
        yield (said[1],), f"there is `{said[0]}` already; write one of them"
    elif said != ["from"]:
        for key in _WAYS:
            if key in entry:
                hint = "write it at the terms" if said == ["sum"] else "a constant has none"
                yield (key,), f"belongs to `from`; {hint}"


def _way(entry: Way, *, adds: bool) -> Transformation:
    return Transformation(
        gain=entry.gain,
        offset=entry.offset,
        delay=entry.delay,
        sample=entry.sample,
        adds=adds,
        converts=entry.convert,
    )
