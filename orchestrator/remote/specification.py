"""What the host of a component needs to create it, in terms of JSON."""

import dataclasses
import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.errors import ComponentTypeError
from orchestrator.kinds import FrozenMapping
from orchestrator.local_module import local_type
from orchestrator.parameters import DRAWN


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentSpec:
    """What the host of a component needs to create it.

    Attributes:
        name: of the component in its system.
        type: the name of an installed component type; or `module:Class`; or the same with the path
            of a file, `/path/module.py:Class`; or the path of an FMU, as a `Path`.
        values: parameter values, as `ComponentType.create` wants them: bool, int, float,
            str, `Path`, records, distributions, and tuples and mappings of these.
    """

    name: str
    type: str | Path
    values: Mapping[str, Any]

    def to_document(self) -> dict[str, Any]:
        """The specification in terms of JSON.

        Raises:
            ComponentTypeError: a value cannot travel.
        """
        values = {}
        for name, value in self.values.items():
            try:
                values[name] = _plain(value)
            except TypeError:
                raise ComponentTypeError(
                    f"component `{self.name}`: parameter `{name}` is {type(value).__name__}, "
                    "which cannot travel to another process"
                ) from None
        return {"name": self.name, "type": _plain(self.type), "values": values}

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "ComponentSpec":
        """What `to_document` described.

        Raises:
            ComponentTypeError: a record is not what the sender has; the releases differ.
        """
        kind = _rich(document["type"])
        if isinstance(kind, str) and kind.rpartition(":")[0].endswith(".py"):
            local_type(kind, Path())  # whose records may be among the values
        values = {name: _rich(value) for name, value in document["values"].items()}
        return cls(name=document["name"], type=kind, values=values)


def _plain(value: Any) -> Any:
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Path():
            return {"path": str(value)}
        case tuple() | list():
            return {type(value).__name__: [_plain(item) for item in value]}
        case FrozenMapping():
            return {"mapping": {name: _plain(each) for name, each in value.items()}}
    if not _is_frozen(type(value)) or "<" in type(value).__qualname__:
        raise TypeError
    fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    return {
        "record": f"{type(value).__module__}:{type(value).__qualname__}",
        "fields": {name: _plain(each) for name, each in fields.items() if each is not DRAWN},
    }


def _rich(value: Any) -> Any:
    match value:
        case {"path": text}:
            return Path(text)
        case {"tuple": items}:
            return tuple(map(_rich, items))
        case {"list": items}:
            return list(map(_rich, items))
        case {"mapping": entries}:
            return FrozenMapping({name: _rich(each) for name, each in entries.items()})
        case {"record": reference, "fields": fields}:
            return _record(reference, {name: _rich(each) for name, each in fields.items()})
    return value


def _record(reference: str, fields: Mapping[str, Any]) -> Any:
    """A frozen dataclass, `module:Class`, with these fields."""
    module, _, names = reference.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for name in names.split("."):
            found = getattr(found, name)
        if not _is_frozen(found):
            raise ComponentTypeError(f"`{reference}` is not a record")
        return found(**fields)
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        kind = type(error).__name__
        what = f"cannot make a `{reference}`: {kind}: {error}; install the same release here"
        raise ComponentTypeError(what) from error


def _is_frozen(kind: Any) -> bool:
    is_record = isinstance(kind, type) and dataclasses.is_dataclass(kind)
    return is_record and kind.__dataclass_params__.frozen
