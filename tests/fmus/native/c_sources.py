"""The C sources of a native unit as text: what each file includes, defines and calls.

Regular expressions serve, for our sources are formatted alike: a definition begins a line, and a
static function says so there.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_NO_CODE: Final = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL)
_INCLUDE: Final = re.compile(r'^#include "(\w+)\.h"', re.MULTILINE)
_DIRECTIVE: Final = re.compile(r"^#(?:[^\n\\]|\\\n)*", re.MULTILINE)
_DEFINITION: Final = re.compile(
    r"^(static )?(?!typedef)[a-zA-Z][\w\s*]*?\b(\w+)\([^;{}]*\)\s*\{", re.MULTILINE
)
_CALL: Final = re.compile(r"\b(\w+)\(")


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A C file and the header of the same name, either of which may be missing.

    Attributes:
        includes: other parts, by name, whose headers are included.
        has_own_header: whether the C file, if there is one, includes the header of its name.
        offers: functions that others may call: those of the C file that are not static, and those
            that the header defines.
        declares: functions that the header names.
        calls: functions that are called here and are not defined here.
    """

    name: str
    includes: frozenset[str]
    has_own_header: bool
    offers: frozenset[str]
    declares: frozenset[str]
    calls: frozenset[str]

    @classmethod
    def of(cls, name: str, source: str, header: str) -> "Part":
        code, declarations = _bare(source), _bare(header)
        found, inline = _DEFINITION.findall(code), _DEFINITION.findall(declarations)
        public = {function for static, function in found if not static}
        here = {function for _, function in (*found, *inline)}
        return cls(
            name=name,
            includes=frozenset(_INCLUDE.findall(source + header)) - {name},
            has_own_header=not source or name in _INCLUDE.findall(source),
            offers=frozenset(public.union(function for _, function in inline)),
            declares=frozenset(_CALL.findall(declarations)),
            calls=frozenset(_CALL.findall(code + declarations)) - here,
        )


def parts(files: Iterable[Path]) -> Mapping[str, Part]:
    """The parts that `files` make up, by name."""
    texts = {path.name: path.read_text() for path in files}
    names = sorted({Path(file).stem for file in texts})
    return {
        name: Part.of(name, texts.get(f"{name}.c", ""), texts.get(f"{name}.h", ""))
        for name in names
    }


def _bare(text: str) -> str:
    """Code without comments, strings and directives of the preprocessor."""
    return _DIRECTIVE.sub("", _NO_CODE.sub(" ", text))
