"""Breaks of C: the rules of universalmutator, line by line."""

import contextlib
import io
import re
from typing import Final

from tests.mutation.mutant import Mutant

_RULES: Final = ("universal.rules", "c_like.rules")
_LEFT_OUT: Final = (
    r"^\s*#",  # the preprocessor
    r"^\s*(//|/\*|\*)",  # comments
    r"\b(model_log|refuse|refuse_mode)\(",  # texts of errors, and the log
    r'^\s*"',  # what such texts go on with
    r"^\s*(typedef|struct|enum|extern|static_assert|_Static_assert)\b",
    r"^[A-Za-z].*\)\s*[;{]?\s*$",  # heads of functions
    r"^}",
)
"""Lines that are left out: what is there is declared or read, not computed with."""


def lines(source: str) -> dict[int, list[tuple[str, str]]]:
    """The breaks that can be made of a file: by line from 1 the rule and the new text of the line.

    Many do not compile; whoever tries them finds out.
    """
    from universalmutator.mutator import mutants_regexp  # noqa: PLC0415 - only the extra has it

    with contextlib.redirect_stdout(io.StringIO()):
        found = mutants_regexp(
            source.splitlines(keepends=True),
            ruleFiles=list(_RULES),
            ignorePatterns=list(_LEFT_OUT),
            ignoreStringOnly=True,
        )
    places: dict[int, list[tuple[str, str]]] = {}
    old = source.splitlines()
    for number, text, _, rule in found:
        new = text.removesuffix("\n")
        if _code(new) != _code(old[number - 1]):
            places.setdefault(number, []).append((_name(rule), new))
    return places


def made(area: str, file: str, source: str, number: int, choice: tuple[str, str]) -> Mutant:
    """The mutant of that line and choice."""
    operator, after = choice
    before = source.splitlines()[number - 1]
    return Mutant(area=area, file=file, line=number, operator=operator, before=before, after=after)


def _code(line: str) -> str:
    """The line without blanks and comments."""
    return re.sub(r"\s+|//.*|/\*.*?\*/", "", line)


def _name(rule: tuple[re.Pattern[str], str]) -> str:
    pattern, text = rule
    return f"{pattern.pattern} ==> {text}".strip().replace("\n", "\\n")
