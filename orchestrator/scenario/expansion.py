"""Families: what a scenario says once for each ego vehicle is written out for every one of them.

After it, every instance is a component like any other: it has a name, a random stream (made from
the name), a process, recorded signals and error messages of its own, and no other part of the core
knows of families.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from orchestrator.errors import Problem
from orchestrator.scenario import families, overrides as overriding
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.families import Binding, Families, instance
from orchestrator.suggestion import suggestion


@dataclass(frozen=True, slots=True)
class Expansion:
    """A document without families.

    Attributes:
        source: the document with families.
        document: without; every part of it has the place of what it was written out from.
        instances: the names of the components that stand for one member each.
        problems: with families and placeholders.
        remarks: families that nothing uses.
    """

    source: Document
    document: Document
    instances: frozenset[str]
    problems: tuple[Problem, ...]
    remarks: tuple[Problem, ...]


def expanded(document: Document) -> Expansion:
    """Write out the families of a scenario, whose shape may be wrong in any way.

    * A component with `each: ego` becomes one for each member, `NAME-MEMBER`; `{ego}` in it is
      that member.
    * A connection with such a component, or with `{ego}`, is repeated for each member.
    * A measure with `{ego}` is repeated for each member; it is named `NAME-MEMBER`.
    * Elsewhere, an item of a list that has `{ego}` becomes one item for each member. In
      `coupling` and `recording`, so does one that begins with the name of such a component.

    Without families the data and the places remain as they are.
    """
    return _Expanding(document, *families.read(document)).result()


def overridden(document: Document, overrides: Sequence[str]) -> Expansion:
    """Write out the families after `overrides`, but before those that are about one instance.

    Args:
        document: of a scenario.
        overrides: `PATH=VALUE`; `components.NAME-MEMBER...` changes one instance, whatever the
            overrides of the whole family say.

    Raises:
        ScenarioError: one problem per override that names no place.
    """
    document, refused = overriding.attempt(document, overrides)
    expansion = expanded(document)
    single = [text for text in refused if overriding.changed_component(text) in expansion.instances]
    overriding.stop_at(refused[text] for text in refused if text not in single)
    return replace(expansion, document=overriding.apply(expansion.document, single))


@dataclass(slots=True)
class _Expanding:
    """One walk over a document, which copies data and places.

    Attributes:
        origins: for what has another address in the copy, that in the source.
        used: the families that components or placeholders name.
    """

    source: Document
    families: Families
    problems: list[Problem]
    places: dict[Address, Place] = field(default_factory=dict)
    origins: dict[Address, Address] = field(default_factory=dict)
    instances: set[str] = field(default_factory=set)
    used: set[str] = field(default_factory=set)

    def result(self) -> Expansion:
        self.used.update(self.families.components.values())
        members = self.families.members.values()
        document = replace(
            self.source,
            data=self._whole(self.source.data),
            places=self.places,
            origins=self.origins,
            members=tuple(dict.fromkeys(name for each in members for name in each)),
        )
        problems = tuple(dict.fromkeys(self.problems))
        instances = frozenset(self.instances)
        return Expansion(self.source, document, instances, problems, tuple(self._remarks()))

    def _remarks(self) -> Iterator[Problem]:
        for family in self.families.members:
            if family not in self.used:
                address = (families.KEY, family)
                what = f"{spell(address)}: no component and no `{{{family}}}` uses this family"
                yield Problem(self.source.key(address), what)

    def _whole(self, data: Any) -> Any:
        self._put((), ())
        if not isinstance(data, dict):
            return self._same(data, ())
        parts = {
            "components": self._components,
            "connections": self._connections,
            "measures": self._measures,
            "time": self._time,
            "coupling": self._names,
            "recording": self._names,
        }
        return {
            key: parts.get(key, self._same)(value, (key,))
            for key, value in data.items()
            if key != families.KEY
        }

    def _put(self, old: Address, new: Address) -> None:
        if old in self.source.places:
            self.places[new] = self.source.places[old]
        if old != new:
            self.origins[new] = old

    def _add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        where = self.source.key(address) if at_key else self.source.value(address)
        self.problems.append(Problem(where, f"{spell(address)}: {what}"))

    def _same(self, value: Any, address: Address) -> Any:
        """A part in which braces mean nothing."""
        self._put(address, address)
        inner = value.items() if isinstance(value, dict) else ()
        for key, each in enumerate(value) if isinstance(value, list) else inner:
            self._same(each, (*address, key))
        return value

    def _names(self, value: Any, address: Address) -> Any:
        """A part whose lists name components."""
        return self._copied(value, address, address, {}, names=True)

    def _copied(
        self, value: Any, old: Address, new: Address, bound: Binding, *, names: bool = False
    ) -> Any:
        """The value at `old`, for the address `new`.

        Args:
            value: any part of the document.
            old: its address.
            new: where it will be.
            bound: what placeholders stand for.
            names: whether items of lists begin with the names of components.
        """
        self._put(old, new)
        match value:
            case dict():
                return {
                    key: self._copied(each, (*old, key), (*new, key), bound, names=names)
                    for key, each in value.items()
                }
            case list():
                return self._items(value, old, new, bound, names=names)
            case str():
                return self._text(value, old, bound, strict=names)
            case _:
                return value

    def _items(
        self, value: Sequence[Any], old: Address, new: Address, bound: Binding, *, names: bool
    ) -> list[Any]:
        items: list[Any] = []
        for index, item in enumerate(value):
            is_name = names and isinstance(item, str)
            found = self.families.along(item) if is_name else self._families_of(item)
            for binding in self.families.bindings(f for f in found if f not in bound):
                text = self.families.renamed(item, binding) if is_name else item
                at = (*new, len(items))
                inner = {**bound, **binding}
                items.append(self._copied(text, (*old, index), at, inner, names=names))
            self.used.update(found)
        return items

    def _families_of(self, value: Any) -> tuple[str, ...]:
        """The families of the texts in `value`; lists in it are repeated by themselves."""
        if isinstance(value, str):
            return self.families.named(value)
        inner = value.values() if isinstance(value, dict) else ()
        return tuple(dict.fromkeys(f for each in inner for f in self._families_of(each)))

    def _text(self, text: str, address: Address, bound: Binding, *, strict: bool) -> str:
        """`text` for the members bound.

        Braces that are no placeholder are a problem if `strict`, or if the file has families.
        """
        if (strict or self.families.declared) and self._has_unknown(text, address):
            return text
        found = [family for family in self.families.named(text) if family not in bound]
        self.used.update(self.families.named(text))
        for family in self.families.several(found):
            members = self.families.members[family]
            what = (
                f"`{{{family}}}` stands for {len(members)} members ({_listed(members)}), and this "
                f"is one text; write one member, an item of a list, or `each: {family}` beside "
                "`parameters`"
            )
            self._add(address, what)
            return text
        only = {family: self.families.members[family][0] for family in found}
        return self.families.filled(text, {**bound, **only})

    def _has_unknown(self, text: str, address: Address) -> bool:
        unknown = self.families.unknown(text)
        for name in unknown:
            hint = suggestion(name, self.families.declared)
            self._add(address, f"`{{{name}}}`: there is no family `{name}`; {hint}")
        return bool(unknown)

    def _components(self, value: Any, address: Address) -> Any:
        if not isinstance(value, dict):
            return self._same(value, address)
        self._put(address, address)
        copies = {}
        taken = {name: (*address, name) for name in value}
        for name, entry in value.items():
            family, old = self.families.components.get(name), (*address, name)
            bare = _without_family(entry)
            if family is None:
                if name in self.families.lost:
                    self._same(entry, old)
                    copies[name] = bare
                else:
                    copies[name] = self._copied(bare, old, old, {})
                continue
            for member in self.families.members[family]:
                copy = instance(name, member)
                if self._is_free(copy, f"of `{name}` for `{member}`", old, taken):
                    self.instances.add(copy)
                    copies[copy] = self._copied(bare, old, (*address, copy), {family: member})
        return copies

    def _is_free(self, name: str, what: str, old: Address, taken: dict[str, Address]) -> bool:
        """Whether `name`, of what stands at `old`, is new; it is taken from now on."""
        if name in taken:
            where = self.source.key(taken[name])
            what = f"the name {what}, `{name}`, is that of another one, in line {where.line}"
            self._add(old, f"{what}; rename one", at_key=True)
            return False
        taken[name] = old
        return True

    def _measures(self, value: Any, address: Address) -> Any:
        if not isinstance(value, dict):
            return self._same(value, address)
        self._put(address, address)
        copies = {}
        taken = {name: (*address, name) for name in value}
        for name, entry in value.items():
            found, old = self._families_of(entry), (*address, name)
            if not found:
                copies[name] = self._copied(entry, old, old, {})
                continue
            for binding in self.families.bindings(found):
                copy = instance(name, *binding.values())
                whose = f"of `{name}` for `{_listed(binding.values())}`"
                if self._is_free(copy, whose, old, taken):
                    new = (*address, copy)
                    copies[copy] = {"type": name, **self._copied(entry, old, new, binding)}
                    key = self.source.key(old)
                    self.places.setdefault((*new, "type"), Place(key, key))
        return copies

    def _time(self, value: Any, address: Address) -> Any:
        """The times; the output that ends the run is one, so that its family has one member."""
        until = value.get("until") if isinstance(value, dict) else None
        if not isinstance(until, str):
            return self._same(value, address)
        old = (*address, "until")
        found = self.families.along(until)
        self.used.update(found)
        self._same(value, address)
        if self._has_unknown(until, old):
            return value
        several = self.families.several(found)
        if several:
            first = self.families.renamed(until, next(iter(self.families.bindings(found))))
            size = len(list(self.families.bindings(several)))
            self._add(old, f"`{until}` is {size} outputs, and one ends the run; write `{first}`")
            return value
        (binding,) = self.families.bindings(found)
        return {**value, "until": self.families.renamed(until, binding)}

    def _connections(self, value: Any, address: Address) -> Any:
        if not isinstance(value, list):
            return self._same(value, address)
        self._put(address, address)
        copies: list[Any] = []
        for index, entry in enumerate(value):
            old = (*address, index)
            ends = _ends(entry)
            if ends is None:
                copies.append(self._copied(entry, old, (*address, len(copies)), {}))
                continue
            for binding in self._bindings_of(old, *ends):
                new = (*address, len(copies))
                bound = _Renamed(self.families, binding)
                copies.append({**self._copied(entry, old, new, binding), **bound.ends(entry)})
        return copies

    def _bindings_of(
        self, old: Address, sources: Mapping[Address, str], target: str
    ) -> Iterable[Binding]:
        """One for each copy of a connection; none if it is wrong."""
        ends = {**sources, ("to",): target}
        unknown = [self._has_unknown(text, (*old, *key)) for key, text in ends.items()]
        before = tuple(dict.fromkeys(f for s in sources.values() for f in self.families.along(s)))
        after = self.families.along(target)
        self.used.update(before, after)
        joined = [f for f in self.families.several(before) if f not in after]
        if any(unknown) or {_component(text) for text in ends.values()} & self.families.lost:
            return ()
        if joined:
            source = next(s for s in sources.values() if set(joined) & {*self.families.along(s)})
            size = len(list(self.families.bindings(joined)))
            one = self.families.renamed(source, next(iter(self.families.bindings(joined))))
            component, _, connector = target.partition(".")
            places = ".".join((component, *(f"{{{family}}}" for family in joined), connector))
            what = (
                f"`{source}` is {size} outputs, and an input takes one; write an input for each, "
                f"such as `{places}`, or one output, such as `from: {one}`"
            )
            self._add((*old, "to"), what)
            return ()
        return self.families.bindings(dict.fromkeys((*after, *before)))


def _without_family(entry: Any) -> Any:
    """The entry of a component as an instance has it; what is no name of a family stays."""
    if not isinstance(entry, dict) or not isinstance(entry.get(families.KEY), str):
        return entry
    return {key: value for key, value in entry.items() if key != families.KEY}


def _ends(entry: Any) -> tuple[Mapping[Address, str], str] | None:
    """The sources and the target of a connection of the right shape; a constant has no source."""
    target = entry.get("to") if isinstance(entry, Mapping) else None
    if not isinstance(target, str):
        return None
    said: dict[Address, Any] = {("from",): entry["from"]} if "from" in entry else {}
    terms = entry.get("sum", [])
    for n, term in enumerate(terms if isinstance(terms, list) else [None]):
        is_short = isinstance(term, str)
        key: Address = ("sum", n) if is_short else ("sum", n, "from")
        said[key] = term if is_short else term.get("from") if isinstance(term, dict) else None
    return (said, target) if all(isinstance(each, str) for each in said.values()) else None


@dataclass(frozen=True, slots=True)
class _Renamed:
    """The ends of connections for some members."""

    families: Families
    binding: Binding

    def ends(self, entry: Mapping[str, Any]) -> dict[str, Any]:
        """The keys of an entry that name components."""
        found: dict[str, Any] = {}
        for key in ("from", "to"):
            if key in entry:
                found[key] = self.families.renamed(entry[key], self.binding)
        if "sum" in entry:
            found["sum"] = [self._term(term) for term in entry["sum"]]
        return found

    def _term(self, term: Any) -> Any:
        if isinstance(term, str):
            return self.families.renamed(term, self.binding)
        return {**term, "from": self.families.renamed(term["from"], self.binding)}


def _component(end: str) -> str:
    return end.partition(".")[0]


def _listed(members: Iterable[str]) -> str:
    return ", ".join(members)
