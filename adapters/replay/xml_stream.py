"""XML files read as a stream, with the place of every element."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias
from xml.parsers import expat

from adapters.replay.files import noting_faults, opened
from adapters.replay.findings import Findings, Place

_CHUNK: Final = 1 << 18
"""Bytes that are read at once."""


class Element(NamedTuple):
    """The start of an element.

    Attributes:
        tag: its name.
        attributes: by name.
        parent: the name of the element around it; empty for the root.
        place: where it stands.
    """

    tag: str
    attributes: Mapping[str, str]
    parent: str
    place: Place


OnStart: TypeAlias = Callable[[Element], None]
OnEnd: TypeAlias = Callable[[str], None]


def read_xml(
    path: Path, findings: Findings, on_start: OnStart, on_end: OnEnd | None = None
) -> Iterator[None]:
    """Read a file, piece by piece; it may be larger than the memory.

    Args:
        path: of the file, which may be compressed (`*.gz`).
        findings: takes what is wrong with the file; reading ends there.
        on_start: called at the start of every element.
        on_end: called with the name of every element at its end.

    Yields:
        Nothing, after each piece of the file.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    around = [""]

    def start(tag: str, attributes: dict[str, str]) -> None:
        place = (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        on_start(Element(tag, attributes, around[-1], place))
        around.append(tag)

    def end(tag: str) -> None:
        around.pop()
        if on_end is not None:
            on_end(tag)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    with noting_faults(findings), opened(path) as stream:
        is_last = False
        while not is_last:
            piece = stream.read(_CHUNK)
            is_last = not piece
            try:
                parser.Parse(piece, is_last)
            except expat.ExpatError as error:
                text = expat.ErrorString(error.code)
                findings.note((error.lineno, error.offset + 1), f"is not well-formed XML: {text}")
                return
            except (LookupError, ValueError) as error:  # an encoding that Python does not know
                findings.note((1, 1), f"is not well-formed XML: {error}")
                return
            yield
