"""What pydantic found, in sentences for the author of the file."""

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from types import NoneType
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from orchestrator.errors import Location, Problem
from orchestrator.scenario.document import Address, Document
from orchestrator.suggestion import suggestion

_KINDS = {
    "string_type": "text",
    "int_type": "a whole number",
    "bool_type": "`true` or `false`",
    "dict_type": "a mapping of `key: value` lines",
    "model_type": "a mapping of `key: value` lines",
    "list_type": "a list, `[a, b]` or lines that begin with `- `",
}

_ARROW = re.compile(r"\s*(\S+)\s*(?:->|=>|→)\s*(\S+)\s*")
"""A connection as many would write it."""


def problems(
    document: Document,
    model: type[BaseModel],
    error: ValidationError,
    *,
    whole: str = "the scenario",
) -> list[Problem]:
    """Every error at the place of the key or value that has to change.

    Args:
        document: that was validated.
        model: of the document.
        error: what pydantic found.
        whole: what the document as a whole is called.
    """
    return [_problem(document, model, each, whole) for each in error.errors(include_url=False)]


def _problem(
    document: Document, model: type[BaseModel], error: ErrorDetails, whole: str
) -> Problem:
    address = error["loc"]
    if address[-1:] == ("[key]",):  # pydantic's way to say that the key itself is wrong
        name, has_reason = address[-2], error["type"] == "value_error"
        what = _describe(error) if has_reason else _no_name(str(name))
        return Problem(document.key(address[:-1]), f"{spell(address[:-2], whole)}: {what}")
    parent, key = address[:-1], address[-1] if address else ""
    if error["type"] == "missing":
        return Problem(_inside(document, parent), f"{spell(parent, whole)}: `{key}` is missing")
    if error["type"] == "extra_forbidden":
        hint = suggestion(str(key), _keys(model, parent))
        what = f"`{key}` is not a key here; {hint}"
        what += "" if "did you mean" in hint else _elsewhere(address)
        return Problem(document.key(address), f"{spell(parent, whole)}: {what}")
    what = _describe(error) + _written(address, error["input"])
    return Problem(document.value(address), f"{spell(address, whole)}: {what}")


def _written(address: Address, said: object) -> str:
    """How to write a whole connection or component; the only thing wrong with one is its kind."""
    match address:
        case ("connections", int()):
            ends = _ARROW.fullmatch(said) if isinstance(said, str) else None
            source, target = ends.groups() if ends else ("one.output", "other.input")
            return f"; write `{{from: {source}, to: {target}}}`"
        case ("components", str()):
            return "; write `{type: ..., step: ...}`"
    return ""


def _elsewhere(address: Address) -> str:
    """Where a key belongs that a component does not have: what its type takes are parameters."""
    match address:
        case ("components", str(), "start"):
            return "; start values are `parameters`: `start.NAME`"
        case ("components", str(), str()):
            return "; what its type or FMU takes belongs under `parameters`"
    return ""


def once(document: Document, problems: Iterable[Problem]) -> list[Problem]:
    """The problems without repetition; those that differ in the member of a family only, once."""
    distinct = dict.fromkeys(problems)
    if not document.members:
        return list(distinct)
    names = "|".join(map(re.escape, sorted(document.members, key=len, reverse=True)))
    member = re.compile(rf"(?<![A-Za-z0-9_])(?:{names})(?![A-Za-z0-9_])")
    alike: dict[Problem, list[Problem]] = defaultdict(list)
    for problem in distinct:
        alike[Problem(problem.where, member.sub("{}", problem.what))].append(problem)
    return [
        found[0]
        if len(found) == 1
        else Problem(found[0].where, f"{found[0].what} (and {len(found) - 1} more alike)")
        for found in alike.values()
    ]


def _no_name(name: str) -> str:
    return f"`{name}` cannot be a name; write letters, digits, `_` and `-` (not first)"


def _inside(document: Document, parent: Address) -> Location:
    """The place to add a key: the key that holds the mapping, or the mapping itself."""
    return document.key(parent)


def _describe(error: ErrorDetails) -> str:
    """What is wrong with one value."""
    kind, found = error["type"], error["input"]
    context: Any = error.get("ctx", {})
    if kind in _KINDS:
        quotes = kind == "string_type" and isinstance(found, int | float)
        hint = f"; write '{found}' in quotes" if quotes else ""
        return f"expected {_KINDS[kind]}, got {show(found)}{hint}"
    if kind == "value_error":
        return str(context["error"])
    if kind in {"too_short", "string_too_short"}:
        return "must not be empty"
    sentences = {
        "literal_error": f"expected {context.get('expected', '')}".replace("'", "`"),
        "greater_than_equal": f"must be at least {context.get('ge')}",
        "string_pattern_mismatch": "expected `component.connector`",
    }
    return f"{sentences.get(kind, error['msg'])}, got {show(found)}"


def show(value: object) -> str:
    """A value of a document as its author would write it, shortened."""
    match value:
        case None:
            return "nothing"
        case bool():
            return "`true`" if value else "`false`"
        case str():
            return f'"{value}"' if len(value) <= 60 else f'"{value[:57]}..."'
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case _:
            text = repr(value)
            return text if len(text) <= 40 else f"{text[:37]}..."


def spell(address: Sequence[str | int], whole: str = "the scenario") -> str:
    """An address as text: `connections[0].from`."""
    text = ""
    for step in address:
        text += f"[{step}]" if isinstance(step, int) else f".{step}"
    return text.removeprefix(".") or whole


def _keys(model: type[BaseModel], address: Sequence[str | int]) -> list[str]:
    """The keys that the model at `address` knows."""
    at: Any = model
    for step in address:
        if isinstance(at, type) and issubclass(at, BaseModel):
            fields = {f.alias or name: f for name, f in at.model_fields.items()}
            at = fields[str(step)].annotation
            present = [kind for kind in get_args(at) if kind is not NoneType]
            at = present[0] if NoneType in get_args(at) else at
        else:
            at = get_args(at)[-1]  # the values of dict[...], the items of list[...]
    return [field.alias or name for name, field in at.model_fields.items()]
