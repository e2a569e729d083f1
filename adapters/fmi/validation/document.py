"""XML that remembers where every element and every attribute was written."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final
from xml.parsers import expat

_ATTRIBUTE: Final = re.compile(rb"""([^\s=<>"']+)\s*=\s*(?:"[^"]*"|'[^']*')""")
_TAG: Final = re.compile(rb"""<[^\s/>]+(?:"[^"]*"|'[^']*'|[^>"'])*>""")


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A place in a file; lines and columns count from 1."""

    line: int
    column: int


class MarkupError(Exception):
    """What was read is no XML.

    Attributes:
        place: where that shows.
    """

    def __init__(self, message: str, place: Place) -> None:
        super().__init__(message)
        self.place = place


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """One element.

    Attributes:
        tag: its name, with a prefix if there is one.
        attributes: by name, in the order of the file.
        place: where it begins.
        places: where each attribute begins.
        children: the elements within, in the order of the file.
    """

    tag: str
    attributes: Mapping[str, str]
    place: Place
    places: Mapping[str, Place]
    children: list["Element"] = field(default_factory=list)

    def get(self, name: str) -> str | None:
        """The value of an attribute, if it is there."""
        return self.attributes.get(name)

    def says(self, name: str) -> bool:
        """Whether a Boolean attribute is there and true."""
        return self.attributes.get(name) in {"true", "1"}

    def all(self, path: str) -> Iterator["Element"]:
        """The elements at a path of tags, `UnitDefinitions/Unit`; `*` stands for any."""
        tag, _, rest = path.partition("/")
        for child in self.children:
            if tag in {"*", child.tag}:
                if rest:
                    yield from child.all(rest)
                else:
                    yield child

    def first(self, path: str) -> "Element | None":
        """The first element at a path of tags, if there is one."""
        return next(self.all(path), None)

    def where(self, attribute: str | None) -> Place:
        """The place of an attribute; that of the element if it is not there."""
        return self.places.get(attribute or "", self.place)


def parse(xml: bytes) -> Element:
    """The root of an XML file.

    Raises:
        MarkupError: it is no XML.
    """
    return _Reader(xml).root()


class _Reader:
    """One reading of a file."""

    def __init__(self, xml: bytes) -> None:
        self._xml = xml
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._begin
        self._parser.EndElementHandler = self._end
        self._open: list[Element] = []
        self._root: Element | None = None

    def root(self) -> Element:
        try:
            self._parser.Parse(self._xml, True)  # noqa: FBT003  (the last piece)
        except expat.ExpatError as error:
            place = Place(error.lineno, error.offset + 1)
            raise MarkupError(expat.errors.messages[error.code], place) from error
        except (LookupError, ValueError) as error:  # an encoding that Python does not know, or use
            raise MarkupError(str(error), Place(1, 1)) from error
        assert self._root is not None  # noqa: S101  (expat refuses a file without elements)
        return self._root

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        parser: Any = self._parser
        place = Place(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        element = Element(tag, attributes, place, self._places(parser.CurrentByteIndex, place))
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _places(self, start: int, place: Place) -> dict[str, Place]:
        """Where the attributes of the element that begins at this byte are."""
        tag = _TAG.match(self._xml, start)
        if tag is None:  # not in an encoding that has ASCII in it
            return {}
        found = {}
        for attribute in _ATTRIBUTE.finditer(self._xml, start, tag.end()):
            before = self._xml[start : attribute.start()].decode("utf-8", "replace")
            lines = before.split("\n")
            column = len(lines[-1]) + (place.column if len(lines) == 1 else 1)
            found[attribute[1].decode("utf-8", "replace")] = Place(
                place.line + len(lines) - 1, column
            )
        return found
