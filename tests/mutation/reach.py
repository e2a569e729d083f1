"""Which tests reach a line: a database of coverage, made once and kept."""

import ast
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final, Self

from typing_extensions import override

_FILES_BESIDE: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownTest:
    """A test that passes in the unbroken tree.

    Attributes:
        name: its node ID.
        seconds: how long it took [s].
        slow: whether it is marked so.
        fixtures: contexts of the fixtures that it shares with others.
    """

    name: str
    seconds: float
    slow: bool = False
    fixtures: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """The path of its file."""
        return self.name.partition("::")[0]


@dataclass(frozen=True, slots=True)
class Reach:
    """The tests, and the lines that each of them reaches.

    Attributes:
        tests: that pass, by node ID.
        lines: of each file by line from 1 the contexts: node IDs, and fixtures.
    """

    tests: Mapping[str, KnownTest]
    lines: Mapping[str, Mapping[int, Sequence[str]]]

    @classmethod
    def load(cls, folder: Path, tree: Path) -> Self:
        """Read what `tests.mutation.measuring` has made.

        Args:
            folder: with the database and the table.
            tree: the copy of the tree in which the tests were run.
        """
        from coverage import CoverageData  # noqa: PLC0415 - only the extra `mutation` has it

        data = CoverageData(str(folder / "reach.sqlite"))
        data.read()
        return cls(_tests(folder / "tests.jsonl"), _Lines(data, tree))

    def of(self, file: str, lines: Iterable[int], *, at_import: bool = False) -> list[KnownTest]:
        """The tests that reach one of the lines, in the order in which to try them.

        Lines that run when a module is imported, by whoever is the first, concern all tests that
        reach the file; so it is for lines that no test reaches. Slow ones count only if there
        are no others. Tests of the module come first, then files by the time that their tests
        take, so that what fails fails early.

        Args:
            file: its path in the tree.
            lines: of it, from 1.
            at_import: whether they run when it is imported.
        """
        known = self.lines.get(file, {})
        found = self._named(context for line in lines for context in known.get(line, ()))
        if at_import or not found:
            found = self._named(context for contexts in known.values() for context in contexts)
        return self.in_order(file, [test for test in found if not test.slow] or found)

    def beside(self, tests: Sequence[KnownTest]) -> list[KnownTest]:
        """Other quick tests of the first files of these: they may assert what was kept from one."""
        files = list(dict.fromkeys(test.file for test in tests))[:_FILES_BESIDE]
        known = {test.name for test in tests}
        quick = [t for t in self.tests.values() if not t.slow and t.name not in known]
        return [test for file in files for test in quick if test.file == file]

    def in_folder(self, folder: str) -> list[KnownTest]:
        """Quick tests of a folder, those of the shortest files first."""
        found = [t for t in self.tests.values() if t.file.startswith(folder) and not t.slow]
        return self.in_order("", found)

    def in_order(self, file: str, tests: Sequence[KnownTest]) -> list[KnownTest]:
        """The same tests, in the order in which to try them for a break of `file`."""
        cost: dict[str, float] = {}
        for test in tests:
            cost[test.file] = cost.get(test.file, 0.0) + test.seconds
        return sorted(tests, key=lambda t: (not is_of(file, t.file), cost[t.file], t.file))

    def _named(self, contexts: Iterable[str]) -> list[KnownTest]:
        names = set(contexts)
        tests = self.tests.values()
        return [t for t in tests if t.name in names or not names.isdisjoint(t.fixtures)]


class _Lines(Mapping[str, Mapping[int, Sequence[str]]]):
    """Lines of files by their paths in the tree, read when they are asked for."""

    def __init__(self, data: Any, tree: Path) -> None:
        self._data, self._tree = data, tree
        self._known: dict[str, Mapping[int, Sequence[str]]] = {}

    @override
    def __getitem__(self, file: str) -> Mapping[int, Sequence[str]]:
        if file not in self._known:
            self._known[file] = self._data.contexts_by_lineno(str(self._tree / file))
        return self._known[file]

    @override
    def __iter__(self) -> Iterator[str]:
        return (str(Path(file).relative_to(self._tree)) for file in self._data.measured_files())

    @override
    def __len__(self) -> int:
        return len(self._data.measured_files())


def runs_at_import(source: str, line: int) -> bool:
    """Whether a line of Python runs when the module is imported: it is in no function."""
    return not any(
        node.body[0].lineno <= line <= (node.end_lineno or 0)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )


def within(tests: Sequence[KnownTest], seconds: float) -> list[KnownTest]:
    """Those of them that fit in that time together, in their order; at least one, if there is any.

    The shortest of each file is taken first, then the second of each: files look at different
    things.
    """
    turns: dict[str, int] = {}
    rank: dict[str, tuple[int, float]] = {}
    for test in sorted(tests, key=lambda t: t.seconds):
        turns[test.file] = turns.get(test.file, 0) + 1
        rank[test.name] = turns[test.file], test.seconds
    left = seconds
    kept: set[str] = set()
    for test in sorted(tests, key=lambda t: rank[t.name]):
        if test.seconds <= left or not kept:
            kept.add(test.name)
            left -= test.seconds
    return [test for test in tests if test.name in kept]


def is_of(file: str, test: str) -> bool:
    """Whether a test file is named after the module, or after its package."""
    stem, package = PurePosixPath(file).stem, PurePosixPath(file).parent.name
    tested = PurePosixPath(test).stem.removeprefix("test_")
    return bool(stem) and (stem in tested or tested in (package, f"{package}_{stem}"))


def _tests(table: Path) -> dict[str, KnownTest]:
    """Those that passed every time."""
    rows = [json.loads(line) for line in table.read_text("utf-8").splitlines()]
    failed = {row["test"] for row in rows if row["outcome"] != "passed"}
    return {
        row["test"]: KnownTest(
            name=row["test"],
            seconds=row["seconds"],
            slow=row["slow"],
            fixtures=tuple(row["fixtures"]),
        )
        for row in rows
        if row["test"] not in failed
    }
