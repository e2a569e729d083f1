"""Paths among the values of parameters."""

import dataclasses
from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any


def anchored(value: Any) -> Any:
    """The value with all paths in it absolute: a component may change the working directory."""
    if isinstance(value, Path):
        return value.absolute()
    if isinstance(value, tuple):
        items = tuple(map(anchored, value))
        return value if _is_same(items, value) else items
    if isinstance(value, Mapping):
        said = dict(value)
        made = {key: anchored(each) for key, each in said.items()}
        return value if _is_same(made.values(), said.values()) else MappingProxyType(made)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        said = {f.name: getattr(value, f.name) for f in dataclasses.fields(value) if f.init}
        made = {name: anchored(each) for name, each in said.items()}
        same = _is_same(made.values(), said.values())
        return value if same else dataclasses.replace(value, **made)
    return value


def _is_same(made: Collection[Any], said: Collection[Any]) -> bool:
    return all(one is other for one, other in zip(made, said, strict=True))
