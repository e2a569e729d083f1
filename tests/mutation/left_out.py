"""Places of a Python file that are left out: what is there is read, not computed with.

Annotations; texts of errors, of the log, and in f-strings; decorators that only declare; `__repr__`
and `__str__`; what type checkers alone see. Docstrings have nothing that an operator would change.
"""

import ast
from collections.abc import Iterator
from typing import Final, TypeGuard

from tests.mutation.operators import Span

_LOGS: Final = frozenset(("debug", "info", "warning", "error", "exception", "critical", "log"))
_DECLARING: Final = frozenset(("final", "override", "overload", "abstractmethod", "dataclass"))
_SAYING: Final = frozenset(("__repr__", "__str__"))


def left_out(source: str) -> list[Span]:
    """The places, each from its first character to the one behind its last."""
    lines = source.splitlines()
    tree = ast.parse(source)
    decorators = ((each.lineno, 0) for each in _declarations(tree))
    spans = [((line, column), (line + 1, 0)) for line, column in decorators]
    return [*spans, *(_span(node, lines) for node in (*_nodes(tree), *_raised(tree)))]


def is_within(position: tuple[int, int], spans: list[Span]) -> bool:
    """Whether a place lies in one of these."""
    return any(start <= position < end for start, end in spans)


def _nodes(tree: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    for node in ast.walk(tree):
        yield from _declared(node)
        if _is_text(node) or _is_never_run(node):
            yield node


def _declared(node: ast.AST) -> Iterator[ast.expr]:
    """Annotations, and types that are named to type checkers."""
    match node:
        case ast.AnnAssign(annotation=annotation):
            yield annotation
        case ast.arg(annotation=ast.expr() as annotation):
            yield annotation
        case ast.FunctionDef(returns=ast.expr() as annotation):
            yield annotation
        case ast.Call(func=ast.Name(id="cast" | "TypeVar"), args=[first, *_]):
            yield first
        case ast.BinOp(op=ast.BitOr()) if _is_type(node.left) and _is_type(node.right):
            yield node


def _is_text(node: ast.AST) -> TypeGuard[ast.expr | ast.stmt]:
    """Whether only people read what this makes."""
    match node:
        case ast.JoinedStr() | ast.BinOp(left=ast.Constant(value=str())):
            return True
        case ast.Expr(value=ast.Call() as call):
            return _is_log(call)
        case ast.FunctionDef(name=name):
            return name in _SAYING
        case ast.Assign(targets=[ast.Name(id="__all__")]):
            return True
    return False


def _is_never_run(node: ast.AST) -> TypeGuard[ast.stmt]:
    """Whether this is for type checkers, or for a module that is run as a program."""
    match node:
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.If(test=ast.Compare(left=ast.Name(id="__name__"))):
            return True
    return False


def _raised(tree: ast.AST) -> Iterator[ast.expr]:
    """What is raised: an error and its text."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            yield node.exc


def _declarations(tree: ast.AST) -> Iterator[ast.expr]:
    """Decorators that declare something to readers and tools."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names = [_name(each) for each in node.decorator_list]
            is_abstract = "abstractmethod" in names
            found = zip(names, node.decorator_list, strict=True)
            yield from (each for name, each in found if is_abstract or name in _DECLARING)


def _is_log(call: ast.Call) -> bool:
    holder = call.func.value if isinstance(call.func, ast.Attribute) else None
    speaker = _name(holder).lower() if holder is not None else ""
    return (_name(call.func) in _LOGS and "log" in speaker) or speaker == "warnings"


def _is_type(node: ast.expr) -> bool:
    """Whether `A | B` of this is a union of types."""
    match node:
        case ast.Constant(value=None):
            return True
        case ast.BinOp(op=ast.BitOr()):
            return _is_type(node.left) and _is_type(node.right)
        case ast.Subscript():
            return _is_type(node.value)
    name = _name(node)
    return name[:1].isupper() or name in ("int", "float", "str", "bytes", "bool", "list", "dict")


def _name(node: ast.expr) -> str:
    match node:
        case ast.Call():
            return _name(node.func)
        case ast.Attribute():
            return node.attr
        case ast.Name():
            return node.id
    return ""


def _span(node: ast.expr | ast.stmt, lines: list[str]) -> Span:
    start = node.lineno, _column(lines[node.lineno - 1], node.col_offset)
    end_line = node.end_lineno or node.lineno
    end_column = node.end_col_offset if node.end_col_offset is not None else node.col_offset
    return start, (end_line, _column(lines[end_line - 1], end_column))


def _column(line: str, offset: int) -> int:
    """Characters before a place of which Python counts the bytes."""
    return len(line.encode()[:offset].decode())
