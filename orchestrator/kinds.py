"""The structure of parameter types: what is a list, a record, or values by name."""

import dataclasses
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar, Union, get_args, get_origin

from typing_extensions import override

T = TypeVar("T")

FILE_OR_NAME: Final = str | Path
"""What is a path if it has a folder or a suffix, and else the name of something installed."""


class FrozenMapping(Mapping[str, T]):
    """A read-only mapping that keeps its order and can be hashed if its values can.

    Equality disregards the order, as that of all mappings.
    """

    __slots__ = ("_entries",)

    def __init__(self, entries: Mapping[str, T]) -> None:
        self._entries = dict(entries)

    @override
    def __getitem__(self, name: str) -> T:
        return self._entries[name]

    @override
    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    @override
    def __len__(self) -> int:
        return len(self._entries)

    @override
    def __hash__(self) -> int:
        return hash(frozenset(self._entries.items()))

    @override
    def __repr__(self) -> str:
        return f"FrozenMapping({self._entries!r})"


@dataclass(frozen=True, slots=True)
class Leaf:
    """A value without parameters beneath it."""

    type: Any


@dataclass(frozen=True, slots=True)
class Optional:
    """What may be `None`."""

    inner: Any


@dataclass(frozen=True, slots=True)
class Listed:
    """A tuple of any length."""

    item: Any


@dataclass(frozen=True, slots=True)
class Named:
    """A read-only mapping from names."""

    value: Any


@dataclass(frozen=True, slots=True)
class Record:
    """A frozen dataclass whose fields are parameters."""

    type: type


Kind: TypeAlias = Leaf | Optional | Listed | Named | Record


def kind_of(annotation: Any) -> Kind:
    """The outermost structure of the type of a parameter."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in {Union, types.UnionType}:
        present = tuple(each for each in arguments if each is not types.NoneType)
        return Leaf(annotation) if present == arguments else Optional(Union[present])  # noqa: UP007
    if origin is tuple:
        return Listed(arguments[0])
    if origin is Mapping and arguments[0] is str:
        return Named(arguments[1])
    return Record(annotation) if is_record(annotation) else Leaf(annotation)


def is_record(annotation: Any) -> bool:
    """Whether it is a frozen dataclass all of whose fields are made with `parameter`."""
    if not (isinstance(annotation, type) and dataclasses.is_dataclass(annotation)):
        return False
    is_frozen = annotation.__dataclass_params__.frozen  # type: ignore[attr-defined]
    return is_frozen and all("doc" in f.metadata for f in dataclasses.fields(annotation))


def record_in(annotation: Any) -> type | None:
    """The record that values of this type are made of, beneath lists and names, if any."""
    match kind_of(annotation):
        case Record(found):
            return found
        case Optional(inner) | Listed(inner) | Named(inner):
            return record_in(inner)
    return None
