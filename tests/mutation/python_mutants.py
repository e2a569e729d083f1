"""Breaks of Python: the operators of Cosmic Ray, and our own."""

import ast
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

from tests.mutation.left_out import is_within, left_out
from tests.mutation.mutant import Mutant, difference
from tests.mutation.operators import OWN

_BINARY: Final = {
    "Add": "Sub",
    "Sub": "Add",
    "Mul": "Div",
    "Div": "Mul",
    "FloorDiv": "Mul",
    "Mod": "FloorDiv",
    "Pow": "Mul",
    "LShift": "RShift",
    "RShift": "LShift",
    "BitAnd": "BitOr",
    "BitOr": "BitAnd",
}
_COMPARED: Final = {
    "Eq": ("NotEq",),
    "NotEq": ("Eq",),
    "Lt": ("LtE", "GtE"),
    "LtE": ("Lt", "Gt"),
    "Gt": ("GtE", "LtE"),
    "GtE": ("Gt", "Lt"),
    "Is": ("IsNot",),
    "IsNot": ("Is",),
}
TAKEN: Final = (
    *(f"ReplaceBinaryOperator_{old}_{new}" for old, new in _BINARY.items()),
    *(f"ReplaceComparisonOperator_{old}_{new}" for old, all_ in _COMPARED.items() for new in all_),
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceUnaryOperator_Delete_Invert",
    "AddNot",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ExceptionReplacer",
    "NumberReplacer",
    "RemoveDecorator",
    "ZeroIterationForLoop",
)
"""Operators of Cosmic Ray that make what people get wrong.

The others turn an operator into each of all others, which any test notices, or `==` into `is`.
"""


_SEPARATED: Final = frozenset(("parameters", "param", "argument"))
"""Where `*` and `/` are no operators."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One break that can be made: an operator, and which of its places in the file."""

    operator: str
    occurrence: int


def places(source: str) -> dict[tuple[int, int], list[Choice]]:
    """The breaks that can be made of a file, by line from 1 and column from 0."""
    from cosmic_ray.ast import ast_nodes, get_ast  # noqa: PLC0415 - only the extra has it

    spans = left_out(source)
    counts = dict.fromkeys(_operators(), 0)
    found: dict[tuple[int, int], list[Choice]] = {}
    for node in ast_nodes(get_ast(source)):
        for name, operator in _operators().items():
            for start, _ in operator.mutation_positions(node):
                if not is_within(start, spans) and node.parent.type not in _SEPARATED:
                    found.setdefault(start, []).append(Choice(name, counts[name]))
                counts[name] += 1
    return found


def made(area: str, file: str, source: str, choice: Choice) -> Mutant | None:
    """The mutant of that choice; none if it is no Python, or says the same."""
    from cosmic_ray.mutating import mutate_code  # noqa: PLC0415

    code = mutate_code(source, _operators()[choice.operator], choice.occurrence)
    if code is None or not _differs(source, code):
        return None
    return difference(area, file, choice.operator, source, code)


@lru_cache(maxsize=1)
def _operators() -> dict[str, Any]:
    from cosmic_ray.plugins import get_operator  # noqa: PLC0415

    taken = {name: get_operator(f"core/{name}")() for name in TAKEN}
    return taken | {each.__name__: each() for each in OWN}


def _differs(source: str, code: str) -> bool:
    """Whether it compiles without a warning, and to something else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            compile(code, "mutant", "exec")
        except (SyntaxError, SyntaxWarning, ValueError):
            return False
    return ast.dump(ast.parse(source)) != ast.dump(ast.parse(code))


def lines_with_places(source: str) -> Iterator[int]:
    """Numbers of the lines with a break, from 1."""
    return iter(sorted({line for line, _ in places(source)}))
