"""Operators that Cosmic Ray lacks, in its form: bugs that are no signs or constants."""

from collections.abc import Iterator
from typing import Any, Final

Span = tuple[tuple[int, int], tuple[int, int]]
"""Where something begins and ends: line from 1, column from 0, each."""

_EXTREMES: Final = {
    "min": "max",
    "minimum": "maximum",
    "fmin": "fmax",
    "any": "all",
    "sin": "cos",
    "ceil": "floor",
    "argmin": "argmax",
    "zeros": "ones",
}
_SWAPPED: Final = _EXTREMES | {new: old for old, new in _EXTREMES.items()}
_SYMMETRIC: Final = frozenset(
    ("min", "max", "minimum", "maximum", "hypot", "add", "multiply", "dot", "gcd", "isclose")
)


class DropStatement:
    """Drops calls whose result nobody takes, assignments to attributes or items, early returns."""

    def mutation_positions(self, node: Any) -> Iterator[Span]:
        """Yield where a statement can become `pass`."""
        if _is_dropped(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Replace the statement."""
        return _keyword(node, "pass")


class SwapArguments:
    """The two arguments of a call change places."""

    def mutation_positions(self, node: Any) -> Iterator[Span]:
        """Yield the arguments of calls with two that may differ."""
        if node.type == "arglist" and _called(node) not in _SYMMETRIC:
            names = [child for child in node.children if child != ","]
            plain = all(child.type not in ("argument", "operator") for child in names)
            if len(names) == 2 and plain and names[0].get_code() != names[1].get_code():
                yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Change their places."""
        first, last = (k for k, child in enumerate(node.children) if child != ",")
        node.children[first], node.children[last] = node.children[last], node.children[first]
        return node


class SwapFunction:
    """A function becomes its counterpart: `min` and `max`, `any` and `all`, `sin` and `cos`."""

    def mutation_positions(self, node: Any) -> Iterator[Span]:
        """Yield names that are called and have a counterpart."""
        if node.type == "name" and node.value in _SWAPPED and _is_called(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Put the other name."""
        node.value = _SWAPPED[node.value]
        return node


def _is_dropped(node: Any) -> bool:
    if node.parent is None or node.parent.type != "simple_stmt":
        return False
    if node.type == "atom_expr":
        last = node.children[-1]
        return bool(last.type == "trailer" and last.children[0] == "(")
    if node.type == "expr_stmt":
        target, sign = node.children[0], node.children[1]
        is_augmented = bool(sign.type == "operator" and sign.value != "=")
        return is_augmented or bool(sign.type == "operator" and target.type == "atom_expr")
    return bool(node.type in ("return_stmt", "raise_stmt")) and _is_early(node)


def _is_early(node: Any) -> bool:
    """Whether a statement of the function comes after the block that ends with this one."""
    suite = node.parent.parent
    return bool(suite.type == "suite" and suite.parent.type == "if_stmt")


def _called(arguments: Any) -> str:
    before = arguments.parent.get_previous_sibling()
    last = before.children[-1] if getattr(before, "children", None) else before
    return str(getattr(last, "value", ""))


def _is_called(name: Any) -> bool:
    holder = name.parent if name.parent.type == "trailer" else name
    after = holder.get_next_sibling()
    return bool(after is not None and after.type == "trailer" and after.children[0] == "(")


def _keyword(node: Any, word: str) -> Any:
    from parso.python import tree  # noqa: PLC0415 - only the extra `mutation` has it

    first = node.get_first_leaf()
    return tree.Keyword(word, node.start_pos, prefix=first.prefix)


OWN: Final = (DropStatement, SwapArguments, SwapFunction)
