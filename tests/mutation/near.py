"""Which test files are near a module: by their names, and by who imports whom. Nothing is run.

Most breaks die of these. Only for the others is it worth to measure which test reaches which line,
which takes as long as the whole suite.
"""

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final, Self

from tests.mutation.areas import unit_of
from tests.mutation.reach import is_of

_PACKAGES: Final = ("orchestrator", "adapters", "fmus", "studies", "benchmarks", "tests")
ENGINE: Final = ("orchestrator/plan/plan.py", "orchestrator/plan/unit.py")
"""Who calls the C of `orchestrator/plan/`: tests that reach them reach it."""

_NAMED: Final = 2
"""A test file named after the module is nearer by so many imports."""


@dataclass(frozen=True, slots=True)
class Near:
    """Who imports whom.

    Attributes:
        imports: of each Python file, by its path in the tree, the files that it imports itself.
    """

    imports: Mapping[str, frozenset[str]]

    @classmethod
    def read(cls, tree: Path) -> Self:
        """Read all sources of a tree."""
        paths = [path for each in _PACKAGES for path in sorted((tree / each).rglob("*.py"))]
        known = frozenset(path.relative_to(tree).as_posix() for path in paths)
        return cls({file: frozenset(_imported(tree, file, known)) for file in sorted(known)})

    def to(self, file: str, most: int) -> list[str]:
        """The test files nearest to a source, the nearest first.

        Those that name the unit's folder are the tests of a C file.

        Args:
            file: its path in the tree, of Python or C.
            most: how many at most.
        """
        if file.endswith(".py"):
            return self._to_module(file)[:most]
        if unit_of(file) is None:
            found = [test for each in ENGINE for test in self._to_module(each)]
            return list(dict.fromkeys(found))[:most]
        shared = ["tests/fmus/native/test_"] if PurePosixPath(file).parts[1] == "native" else []
        folders = (*shared, f"tests/fmus/{unit_of(file)}/test_")
        return [test for each in folders for test in sorted(self.imports) if test.startswith(each)]

    def _to_module(self, file: str) -> list[str]:
        distances = dict(self._distances(file))
        tests = [each for each in distances if PurePosixPath(each).name.startswith("test_")]
        return sorted(tests, key=lambda t: (distances[t] - _NAMED * is_of(file, t), t))

    def _distances(self, file: str) -> Iterator[tuple[str, int]]:
        """All that import it, themselves or by others, with the number of imports on the way."""
        seen, front, distance = {file}, {file}, 0
        while front:
            distance += 1
            front = {each for each, whom in self.imports.items() if whom & front} - seen
            seen |= front
            yield from ((each, distance) for each in sorted(front))


def _imported(tree: Path, file: str, known: frozenset[str]) -> Iterator[str]:
    for node in ast.walk(ast.parse((tree / file).read_text("utf-8"))):
        match node:
            case ast.Import(names=names):
                wanted = [name.name for name in names]
            case ast.ImportFrom(module=str() as module, names=names, level=0):
                wanted = [module, *(f"{module}.{name.name}" for name in names)]
            case ast.Call(
                func=ast.Attribute(attr="importorskip" | "import_module"),
                args=[ast.Constant(value=str() as module), *_],
            ):
                wanted = [module]
            case _:
                continue
        for each in wanted:
            path = each.replace(".", "/")
            yield from known.intersection((f"{path}.py", f"{path}/__init__.py"))
