"""The scalars of YAML 1.2 on PyYAML's parser, and syntax errors in plain words.

PyYAML implements YAML 1.1: it reads `5.9e9` as text, `on` as a boolean, `12:30` as 750 and
`010` as 8. Only its scanner, parser and composer are used here; plain scalars are read by the
core schema of YAML 1.2.2, section 10.3.2.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import yaml
from typing_extensions import override
from yaml.composer import Composer
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import BaseResolver
from yaml.scanner import Scanner, ScannerError

Scalar = str | int | float | bool | None

MAPPING: Final = "tag:yaml.org,2002:map"
SEQUENCE: Final = "tag:yaml.org,2002:seq"
_PREFIX: Final = "tag:yaml.org,2002:"
_TEXT: Final = "tag:yaml.org,2002:str"

_MAXIMUM_DIGITS: Final = 4000
"""Longer integers are refused; Python itself stops at 4300 digits."""


class UnreadableScalarError(ValueError):
    """A scalar that its tag does not allow; the message is for the author of the file."""


def _integer(base: int) -> Callable[[str], int]:
    def convert(text: str) -> int:
        if len(text) > _MAXIMUM_DIGITS:
            raise UnreadableScalarError(f"a number of {len(text)} digits is too long")
        return int(text if base == 10 else text[2:], base)

    return convert


def _infinity(text: str) -> float:
    return -math.inf if text.startswith("-") else math.inf


@dataclass(frozen=True, slots=True)
class _Row:
    """One row of the table of the core schema."""

    tag: str
    form: re.Pattern[str]
    convert: Callable[[str], Scalar]


_CORE_SCHEMA: Final = (
    _Row(_PREFIX + "null", re.compile(r"null|Null|NULL|~|"), lambda _: None),
    _Row(
        _PREFIX + "bool",
        re.compile(r"true|True|TRUE|false|False|FALSE"),
        lambda text: text.lower() == "true",
    ),
    _Row(_PREFIX + "int", re.compile(r"[-+]?[0-9]+"), _integer(10)),
    _Row(_PREFIX + "int", re.compile(r"0o[0-7]+"), _integer(8)),
    _Row(_PREFIX + "int", re.compile(r"0x[0-9a-fA-F]+"), _integer(16)),
    _Row(
        _PREFIX + "float",
        re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"),
        float,
    ),
    _Row(_PREFIX + "float", re.compile(r"[-+]?\.(inf|Inf|INF)"), _infinity),
    _Row(_PREFIX + "float", re.compile(r"\.(nan|NaN|NAN)"), lambda _: math.nan),
)


def scalar(node: yaml.ScalarNode) -> Scalar:
    """The value of a scalar node.

    Raises:
        UnreadableScalarError: the text does not fit its tag, or the tag is unknown.
    """
    text: str = node.value
    if node.tag == _TEXT:
        return text
    rows = [row for row in _CORE_SCHEMA if row.tag == node.tag]
    if not rows:
        raise UnreadableScalarError(foreign_tag(node))
    for row in rows:
        if row.form.fullmatch(text):
            return row.convert(text)
    raise UnreadableScalarError(f"`{text}` cannot be read as {_shown(node.tag)}")


class Parsing(Reader, Scanner, Parser, Composer, BaseResolver):
    """PyYAML with the core schema of YAML 1.2 as its resolver, and without a constructor."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        BaseResolver.__init__(self)

    @override
    def scan_flow_scalar_non_spaces(self, double: bool, start_mark: yaml.Mark) -> list[str]:
        """The pieces of a quoted scalar up to the next space.

        Raises:
            ScannerError: an escape names no character; PyYAML lets it pass, or stumbles.
        """
        try:
            pieces: list[str] = super().scan_flow_scalar_non_spaces(double, start_mark)
        except (ValueError, OverflowError):
            raise self._no_character(start_mark) from None
        if any("\ud800" <= each <= "\udfff" for piece in pieces for each in piece):
            raise self._no_character(start_mark)
        return pieces

    def _no_character(self, start: yaml.Mark) -> ScannerError:
        problem = (
            "found an escape that is no character; they go from \\U00000000 to \\U0010FFFF, "
            "without the halves \\uD800 to \\uDFFF"
        )
        return ScannerError(
            "while scanning a double-quoted scalar", start, problem, self.get_mark()
        )

    @override
    def resolve(self, kind: type[yaml.Node], value: str | None, implicit: Any) -> str:
        """The tag of a node without one; `implicit` is true (or starts so) for plain scalars."""
        if kind is yaml.MappingNode:
            return MAPPING
        if kind is yaml.SequenceNode:
            return SEQUENCE
        if value is not None and implicit[0]:
            return next((row.tag for row in _CORE_SCHEMA if row.form.fullmatch(value)), _TEXT)
        return _TEXT


def foreign_tag(node: yaml.Node) -> str:
    """The sentence for a tag that scenario files do not know."""
    return f"the tag `{_shown(node.tag)}` has no meaning here; remove it"


def _shown(tag: str) -> str:
    return tag.replace(_PREFIX, "!!")


_IN_PLAIN_WORDS: Final = (
    ("'\\t'", "a tab cannot be used for indentation; write spaces"),
    (
        "mapping values are not allowed",
        "this `:` is not expected here; quote the value or check the indentation here and above",
    ),
    ("expected <block end>, but found", "the indentation does not match the lines above"),
    ("could not find expected ':'", "a `:` is missing after the key"),
    ("expected ',' or ']'", "the list opened with `[` in line {line} is not closed by now"),
    (
        "expected ',' or '}'",
        "the mapping opened with `{{` in line {line} is not closed by now",
    ),
    ("but found another document", "a second document begins here; a scenario is one document"),
    ("found unexpected end of stream", "the quote opened in line {line} is not closed"),
    ("that cannot start any token", "a value cannot start with this character; quote the value"),
    ("found undefined alias", "this alias has no anchor `&` before it"),
    ("found duplicate anchor", "this anchor is defined twice"),
)


def syntax_error(error: yaml.MarkedYAMLError) -> str:
    """What is wrong, for somebody who does not know how a YAML scanner works."""
    raw = error.problem or error.context or "this is not YAML"
    line = error.context_mark.line + 1 if error.context_mark else 1
    mark = error.problem_mark
    if mark is not None and mark.buffer and mark.buffer[mark.pointer : mark.pointer + 1] == "[":
        return "`[` begins a list here; write the text in quotes, such as `{from: 'a.x[2]', ...}`"
    for pattern, sentence in _IN_PLAIN_WORDS:
        if pattern in raw:
            return sentence.format(line=line)
    return raw
