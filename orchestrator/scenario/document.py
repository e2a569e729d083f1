"""YAML documents that remember where every key and every value was written."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import yaml
from yaml.reader import ReaderError

from orchestrator.errors import Location, Problem, ScenarioError
from orchestrator.regular_files import NoFileError, read_file
from orchestrator.scenario import yaml12

Address: TypeAlias = tuple[str | int, ...]
"""The keys and indices that lead from the top of a document to a value."""

MAXIMUM_VALUES: Final = 100_000
"""Values a document may have once its aliases are expanded; a billion laughs has more."""

MAXIMUM_DEPTH: Final = 60
"""Levels of nesting; a scenario needs fewer than ten."""

MAXIMUM_BYTES: Final = 16 * 1024 * 1024
"""A file may have so many bytes: more than `MAXIMUM_VALUES` of a hundred bytes each."""

_KEPT: Final = 100_000
"""The nodes of a text with so many characters are kept for the next who reads it."""

_ARCHIVE: Final = b"PK\x03\x04"
"""How ZIP archives begin."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a key and its value were written; an item of a list has no key of its own."""

    key: Location
    value: Location


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data, and the place of every value in it.

    Attributes:
        file: the name that locations carry.
        data: mappings, lists and scalars of YAML 1.2; keys are strings.
        places: by address; every value of `data` has one.
        folders: where relative paths start, by the name of the file that says them.
        origins: for a value that stands at another address in the file, because families are
            written out, that address.
        members: of all families that are written out.
    """

    file: str
    data: Any
    places: Mapping[Address, Place]
    folders: Mapping[str, Path] = field(default_factory=dict)
    origins: Mapping[Address, Address] = field(default_factory=dict)
    members: tuple[str, ...] = ()

    @classmethod
    def read(cls, path: Path) -> "Document":
        """Read a file.

        Raises:
            ScenarioError: the file cannot be read, or is not YAML.
        """
        try:
            raw = read_file(path, MAXIMUM_BYTES)
        except OSError as error:
            reason = "there is no such file" if not path.exists() else error.strerror
            raise _failure(str(path), 1, 1, f"cannot be read: {reason}") from None
        except NoFileError as error:
            raise _failure(str(path), 1, 1, f"cannot be read: {error}") from None
        if raw.startswith(_ARCHIVE):
            what = "is an archive; `nlosim ssp import` makes a scenario of an SSP package"
            raise _failure(str(path), 1, 1, what)
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            column = error.start - (raw.rfind(b"\n", 0, error.start) + 1) + 1
            raise _failure(
                str(path),
                line,
                column,
                f"byte 0x{raw[error.start]:02x} is not UTF-8; "
                "save the file with the encoding UTF-8",
            ) from None
        return replace(cls.parse(text, str(path)), folders={str(path): path.parent})

    @classmethod
    def parse(cls, text: str, file: str, *, offset: int = 0) -> "Document":
        """Read YAML text.

        Args:
            text: the document.
            file: the name for locations.
            offset: added to the columns of the first line.

        Raises:
            ScenarioError: every duplicate key, merge key and unknown tag, or the first
                error of syntax.
        """
        root = _compose(text, file, offset)
        reading = _Reading(file, offset)
        data = reading.value(root, (), None)
        if reading.problems:
            raise ScenarioError(sorted(reading.problems, key=lambda p: p.where))
        return cls(file, data, reading.places)

    def key(self, address: Address) -> Location:
        """Where the key at `address` is, or the nearest enclosing value."""
        place = self.places.get(address)
        return place.key if place else self.value(address)

    def value(self, address: Address) -> Location:
        """Where the value at `address` is, or the nearest enclosing value."""
        while address and address not in self.places:
            address = address[:-1]
        place = self.places.get(address)
        return place.value if place else Location(self.file, 1, 1)

    def written(self, address: Address) -> Address:
        """The address in the file of what stands at `address`."""
        for n in range(len(address), 0, -1):
            if address[:n] in self.origins:
                return (*self.origins[address[:n]], *address[n:])
        return address

    def folder(self, address: Address) -> Path:
        """Where a relative path at `address` starts; what no file says, at `file`."""
        return self.folders.get(self.value(address).file, self.folders.get(self.file, Path()))

    def is_in_a_file(self, where: Location) -> bool:
        """Whether `where` is in a file rather than on the command line."""
        return where.file in self.folders


def _failure(file: str, line: int, column: int, what: str) -> ScenarioError:
    return ScenarioError([Problem(Location(file, line, column), what)])


def _compose(text: str, file: str, offset: int) -> yaml.Node:
    """Parse `text` into nodes, or say where it stops being YAML."""
    try:
        root = _nodes(text) if len(text) <= _KEPT else _nodes.__wrapped__(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = _location(file, mark, offset) if mark else Location(file, 1, 1)
        raise ScenarioError([Problem(where, yaml12.syntax_error(error))]) from None
    except ReaderError as error:
        before = text[: error.position]
        line = before.count("\n") + 1
        column = error.position - (before.rfind("\n") + 1) + 1
        what = f"the character U+{ord(text[error.position]):04X} is not allowed in YAML"
        raise _failure(file, line, column, what) from None
    except RecursionError:
        raise _failure(file, 1, 1, "lists or mappings are nested too deeply") from None
    if root is None:
        what = "the file is empty; see docs/scenario-reference.md for what a scenario contains"
        raise _failure(file, 1, 1, what)
    return root


@lru_cache(maxsize=64)
def _nodes(text: str) -> yaml.Node | None:
    """The nodes of `text`, which nobody changes: an experiment reads a scenario many times."""
    found: yaml.Node | None = yaml12.Parsing(text).get_single_node()
    return found


def _location(file: str, mark: yaml.Mark, offset: int) -> Location:
    column = mark.column + 1 + (offset if mark.line == 0 else 0)
    return Location(file, mark.line + 1, column)


@dataclass(slots=True)
class _Reading:
    """One walk over the nodes of a document, collecting data, places and problems."""

    file: str
    offset: int
    places: dict[Address, Place] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    _enclosing: set[int] = field(default_factory=set)

    def value(self, node: yaml.Node, address: Address, key: Location | None) -> Any:
        where = _location(self.file, node.start_mark, self.offset)
        self.places[address] = Place(key or where, where)
        if len(self.places) > MAXIMUM_VALUES:
            what = f"aliases expand to more than {MAXIMUM_VALUES} values"
            raise ScenarioError([Problem(where, what)])
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, where)
        if id(node) in self._enclosing:
            raise ScenarioError([Problem(where, "this value contains itself through an alias")])
        if len(address) >= MAXIMUM_DEPTH:
            raise ScenarioError([Problem(where, "lists or mappings are nested too deeply")])
        self._enclosing.add(id(node))
        try:
            if isinstance(node, yaml.MappingNode):
                self._expect_tag(node, yaml12.MAPPING, where)
                return {
                    name: self.value(child, (*address, name), place)
                    for name, child, place in self._entries(node)
                }
            self._expect_tag(node, yaml12.SEQUENCE, where)
            return [self.value(item, (*address, i), None) for i, item in enumerate(node.value)]
        finally:
            self._enclosing.discard(id(node))

    def _entries(self, node: yaml.MappingNode) -> Iterator[tuple[str, yaml.Node, Location]]:
        """The entries of a mapping whose keys are sound."""
        seen: dict[str, Location] = {}
        for key, child in node.value:
            where = _location(self.file, key.start_mark, self.offset)
            name = key.value
            if not isinstance(key, yaml.ScalarNode) or not name:
                self.problems.append(Problem(where, "a key must be text"))
            elif name == "<<" and key.style is None:
                what = "merge keys are not part of YAML 1.2; write the keys out"
                self.problems.append(Problem(where, what))
            elif name in seen:
                what = f"the key `{name}` appears twice, first in line {seen[name].line}"
                self.problems.append(Problem(where, what))
            else:
                seen[name] = where
                yield name, child, where

    def _scalar(self, node: yaml.ScalarNode, where: Location) -> yaml12.Scalar:
        try:
            return yaml12.scalar(node)
        except yaml12.UnreadableScalarError as error:
            self.problems.append(Problem(where, str(error)))
            return None

    def _expect_tag(self, node: yaml.Node, tag: str, where: Location) -> None:
        if node.tag != tag:
            self.problems.append(Problem(where, yaml12.foreign_tag(node)))
