"""XML files element by element, with the place of each; nothing is kept."""

import abc
import gzip
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Final, TypeAlias, cast
from xml.parsers import expat

from typing_extensions import override

from orchestrator.errors import Location, Problem

Attributes: TypeAlias = Mapping[str, str]

_CHUNK: Final = 1 << 20
_GZIP: Final = b"\x1f\x8b"


class Elements(abc.ABC):
    """What is done with the elements of a file, in their order."""

    def __init__(self) -> None:
        self._here: Callable[[], Location] = _nowhere

    def bind(self, here: Callable[[], Location]) -> None:
        """A file begins; `here` tells the place of the element that is being reported."""
        self._here = here

    def root(self, name: str, attributes: Attributes) -> bool:
        """The root element begins; returns whether the rest of the file matters."""
        del name, attributes
        return True

    @abc.abstractmethod
    def start(self, name: str, attributes: Attributes) -> None:
        """An element within the root begins."""

    def end(self, name: str) -> None:
        """An element ends."""

    def text(self, data: str) -> None:
        """Part of the text of the element that began last."""


class WellFormed(Elements):
    """Nothing is done with the elements: only the syntax of the file matters."""

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        pass


class _Refused(Exception):  # noqa: N818 - a sentence about the file, to be located
    """The file is XML, but not of a kind that is read."""


class _Enough(Exception):  # noqa: N818 - no error
    """The rest of the file does not matter."""


def read(path: Path, elements: Elements) -> list[Problem]:
    """Hand every element of a file to `elements`.

    Document type definitions are refused, and with them every entity that a file declares.

    Args:
        path: of an XML file, or of one that gzip has compressed, whatever its name.
        elements: reads them. Those before a syntax error have been handed over when it is found.

    Returns:
        Why the file cannot be read to its end, at the place where it ends to be XML; at most one
        problem.
    """
    parser = expat.ParserCreate()
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    file = str(path)

    def here() -> Location:
        return Location(file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def begin(name: str, attributes: Attributes) -> None:
        if not elements.root(name, attributes):
            raise _Enough
        parser.StartElementHandler = elements.start

    elements.bind(here)
    parser.StartElementHandler = begin
    parser.EndElementHandler = elements.end
    if type(elements).text is not Elements.text:
        parser.CharacterDataHandler = elements.text
    parser.StartDoctypeDeclHandler = _refuse_document_type
    try:
        with opened(path) as stream:
            while chunk := stream.read(_CHUNK):
                parser.Parse(chunk, False)  # noqa: FBT003 - expat's signature
            parser.Parse(b"", True)  # noqa: FBT003
    except _Enough:
        return []
    except _Refused as refusal:
        return [Problem(here(), str(refusal))]
    except expat.ExpatError as error:
        where = Location(file, error.lineno, error.offset + 1)
        return [Problem(where, f"not XML: {expat.ErrorString(error.code)}{_hint(error)}")]
    except (OSError, EOFError, zlib.error, LookupError, ValueError) as error:
        return [Problem(Location(file, 1, 1), _unreadable(error))]
    return []


def opened(path: Path) -> IO[bytes]:
    """The bytes of a file, uncompressed.

    Raises:
        OSError: there is no such file, or it may not be read.
    """
    with path.open("rb") as stream:
        is_compressed = stream.read(len(_GZIP)) == _GZIP
    return cast("IO[bytes]", gzip.open(path)) if is_compressed else path.open("rb")


def mentions(path: Path, text: bytes) -> bool:
    """Whether `text` stands in a file, without parsing it; a damaged one is left to `read`."""
    tail = b""
    try:
        with opened(path) as stream:
            while block := stream.read(_CHUNK):
                if text in tail + block:
                    return True
                tail = block[-len(text) :]
    except (EOFError, OSError, zlib.error):
        return True
    return False


def _unreadable(error: Exception) -> str:
    match error:
        case EOFError() | zlib.error() | gzip.BadGzipFile():
            return f"the compressed file is damaged ({error}); compress it again"
        case OSError():
            return f"cannot be read: {error.strerror}"
        case _:  # an encoding that Python or expat lacks
            return f"cannot be decoded ({error}); save it as UTF-8"


def _hint(error: expat.ExpatError) -> str:
    at_end = {expat.errors.XML_ERROR_NO_ELEMENTS, expat.errors.XML_ERROR_UNCLOSED_TOKEN}
    is_cut = expat.ErrorString(error.code) in at_end
    return "; the file is empty or has been cut off" if is_cut else ""


def _refuse_document_type(*_: object) -> None:
    raise _Refused(
        "a document type (`<!DOCTYPE ...>`) is refused, since it can declare entities that grow "
        "without bound or read other files; delete it, SUMO does not need it"
    )


def _nowhere() -> Location:
    raise AssertionError("no file is being read")
