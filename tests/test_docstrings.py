"""Docstrings are sentences that stand alone; functions of arrays say of which shape these are.

What the rules of CONTRIBUTING.md mean to this test:

* A docstring, also one of a module or below a constant, begins with a capital letter, a digit, a
  quotation mark or code in backquotes, and neither with "The same" nor with a preposition: "Of the
  body [m]." begins in the middle of a sentence whose beginning is the name above. "From" may begin
  a title: "From a scan to a message."
* The docstring of a public function or method that takes or gives arrays (NumPy's or PyTorch's)
  names their shapes with this word: "shape (vehicle, 3)", "of the shape of `distance`", "any
  shape". Public is what has no leading underscore, nor its class or module; an `@override` has no
  docstring, because the declaration says it.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Final, TypeAlias

import pytest

ROOT: Final = Path(__file__).parents[1]
PACKAGES: Final = ("orchestrator", "fmus", "adapters", "studies", "benchmarks")

ARRAY_TYPES: Final = frozenset({"ndarray", "NDArray", "Tensor"})
PREPOSITIONS: Final = (
    "Above|Along|As|At|Before|Below|Behind|Beside|Between|By|For|In|Into|Of|On|Over|Per|Than|Through|"
    "To|Under|With|Without"
)
SENTENCE: Final = re.compile(rf"(?!({PREPOSITIONS}|The same)\b)[A-Z0-9`\"]")
SHAPE: Final = re.compile(r"\bshapes?\b", re.IGNORECASE)


Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def modules(package: str) -> dict[str, ast.Module]:
    """The parsed modules of a package, by their paths in the repository."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted((ROOT / package).rglob("*.py"))
    }


def words(expression: ast.expr | None) -> set[str]:
    """The names in a type, also in a quoted one."""
    return set(re.findall(r"\w+", ast.unparse(expression))) if expression else set()


@cache
def array_types() -> frozenset[str]:
    """The names of arrays in annotations: those of the libraries, and ours for them."""
    named: set[str] = set()
    for package in PACKAGES:
        for module in modules(package).values():
            for line in module.body:
                match line:
                    case ast.Assign(targets=[ast.Name(id=name)], value=value):
                        pass
                    case ast.AnnAssign(target=ast.Name(id=name), value=value):
                        pass
                    case _:
                        continue
                if not isinstance(value, ast.Call) and words(value) & ARRAY_TYPES:
                    named.add(name)
    return ARRAY_TYPES | named


def public_functions(body: Iterable[ast.stmt]) -> Iterator[Function]:
    """The public functions and methods of a module or a class; no overrides."""
    for line in body:
        match line:
            case ast.ClassDef(name=name, body=members) if not name.startswith("_"):
                yield from public_functions(members)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                decorators = set[str]().union(*map(words, line.decorator_list))
                if not line.name.startswith("_") and "override" not in decorators:
                    yield line


def has_arrays(function: Function) -> bool:
    """Whether arrays go in or come out."""
    given = function.args
    arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    annotations = [*(argument.annotation for argument in arguments), function.returns]
    return any(words(annotation) & array_types() for annotation in annotations)


def without_shapes(path: str, module: ast.Module) -> list[str]:
    """The functions whose docstrings leave the shapes of arrays open."""
    if Path(path).name.removesuffix("__init__.py").startswith("_"):
        return []
    return [
        f"{path}:{function.lineno} {function.name}"
        for function in public_functions(module.body)
        if has_arrays(function) and not SHAPE.search(ast.get_docstring(function) or "")
    ]


def fragments(path: str, module: ast.Module) -> list[str]:
    """The docstrings that do not begin as sentences."""
    found = []
    for node in ast.walk(module):
        if not isinstance(node, ast.Module | ast.ClassDef | Function):
            continue
        for line in node.body:
            match line:
                case ast.Expr(value=ast.Constant(value=str() as text)) if not SENTENCE.match(text):
                    found.append(f"{path}:{line.lineno} {text.splitlines()[0]}")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("package", PACKAGES)
def test_functions_of_arrays_say_of_which_shape(package: str) -> None:
    found = [
        line for path, module in modules(package).items() for line in without_shapes(path, module)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_begin_as_sentences(package: str) -> None:
    found = [line for path, module in modules(package).items() for line in fragments(path, module)]
    assert not found, "\n".join(found)


def test_the_rules_see_what_they_are_for() -> None:
    """The examples of this module's docstring."""
    assert not SENTENCE.match("Of the body [m].")
    assert not SENTENCE.match("The same for sizes and heights [m].")
    assert not SENTENCE.match("[m/s].")
    assert SENTENCE.match("Offsets of the body from the lane [m], shape (vehicle,).")
    assert SENTENCE.match("`values[index]`, several times faster on a CPU.")
    assert {"Array", "Float", "Tensor"} <= array_types()
