"""`each:`: the families of a scenario, and the placeholders that stand for their members."""

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from orchestrator.errors import Problem
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.schema import is_family, is_member
from orchestrator.suggestion import suggestion

KEY: Final = "each"
"""The key of the families at the top of a scenario, and of its family in a component."""

_PLACEHOLDER: Final = re.compile(r"\{([A-Za-z][A-Za-z0-9_-]*)\}")

Binding: TypeAlias = Mapping[str, str]
"""The member that each family stands for at one place."""


@dataclass(frozen=True, slots=True)
class Families:
    """The families of a scenario.

    Attributes:
        declared: every name under `each`, also those whose members are wrong.
        members: by family, in order; of sound families only.
        components: the family of each component that has a sound one.
        lost: components whose family is not sound, or not there.
    """

    declared: frozenset[str]
    members: Mapping[str, tuple[str, ...]]
    components: Mapping[str, str]
    lost: frozenset[str]

    def named(self, text: str) -> tuple[str, ...]:
        """The sound families that have a placeholder in `text`."""
        return _distinct(f for f in _PLACEHOLDER.findall(text) if f in self.members)

    def unknown(self, text: str) -> tuple[str, ...]:
        """The placeholders in `text` that are of no family."""
        return _distinct(f for f in _PLACEHOLDER.findall(text) if f not in self.declared)

    def along(self, text: str) -> tuple[str, ...]:
        """The families of `text`, which begins with the name of a component."""
        family = self.components.get(text.partition(".")[0])
        return _distinct((*(() if family is None else (family,)), *self.named(text)))

    def several(self, families: Iterable[str]) -> tuple[str, ...]:
        """Those of `families` that have more than one member."""
        return tuple(family for family in families if len(self.members[family]) > 1)

    def bindings(self, families: Iterable[str]) -> Iterator[Binding]:
        """Every choice of one member of each of `families`; one empty choice of no families."""
        names = tuple(families)
        for chosen in itertools.product(*(self.members[name] for name in names)):
            yield dict(zip(names, chosen, strict=True))

    def filled(self, text: str, binding: Binding) -> str:
        """`text` with members for the placeholders of the families bound."""
        return _PLACEHOLDER.sub(lambda found: binding.get(found[1], found[0]), text)

    def renamed(self, text: str, binding: Binding) -> str:
        """`filled`, of a text that begins with the name of a component."""
        name, dot, rest = text.partition(".")
        if name in self.components and self.components[name] in binding:
            name = instance(name, binding[self.components[name]])
        return self.filled(f"{name}{dot}{rest}", binding)


def instance(component: str, *members: str) -> str:
    """The name that a component, or a measure, has for one member.

    >>> instance("relay", "first")
    'relay-first'
    """
    return "-".join((component, *members))


def read(document: Document) -> tuple[Families, list[Problem]]:
    """The families of `document`, and what is wrong with them beyond their shape.

    What has the wrong shape is left out; the schema finds it.
    """
    data = document.data if isinstance(document.data, dict) else {}
    families = data.get(KEY)
    entries = families if isinstance(families, dict) else {}
    problems: list[Problem] = []
    members = {
        name: found
        for name, listed in entries.items()
        if is_family(name) and (found := _members(document, name, listed, problems))
    }
    users = _users(data.get("components"))
    components = {name: family for name, family in users.items() if family in members}
    for name, family in users.items():
        if family not in entries:
            address = ("components", name, KEY)
            what = f"{spell(address)}: there is no family `{family}`; {suggestion(family, entries)}"
            problems.append(Problem(document.value(address), what))
    lost = frozenset(users) - frozenset(components)
    return Families(frozenset(entries), members, components, lost), problems


def _members(
    document: Document, family: str, listed: Any, problems: list[Problem]
) -> tuple[str, ...]:
    """The sound members of one family, each once."""
    found: list[str] = []
    for index, member in enumerate(listed if isinstance(listed, list) else ()):
        if not isinstance(member, str) or not is_member(member):
            continue
        if member in found:
            address = (KEY, family, index)
            what = f"{spell(address)}: `{member}` is a member of `{family}` already; remove one"
            problems.append(Problem(document.value(address), what))
        else:
            found.append(member)
    return tuple(found)


def _users(components: Any) -> dict[str, str]:
    """The family that each component names."""
    entries = components.items() if isinstance(components, dict) else ()
    named = {name: entry.get(KEY) for name, entry in entries if isinstance(entry, dict)}
    return {name: family for name, family in named.items() if isinstance(family, str)}


def _distinct(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
