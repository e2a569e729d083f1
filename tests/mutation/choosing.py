"""Which tests try a break: those that reach its lines, or, before that is known, those near it."""

import abc
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from typing_extensions import override

from tests.mutation import journal
from tests.mutation.areas import unit_of
from tests.mutation.mutant import Mutant
from tests.mutation.near import ENGINE, Near
from tests.mutation.reach import KnownTest, Reach, runs_at_import, within
from tests.mutation.trial import Limits, Outcome, Patience, run, run_files

_FILES_FIRST: Final = 2
_FILES_NEAR: Final = 8


class Choice(abc.ABC):
    """Runs the tests that are to try a break."""

    @property
    @abc.abstractmethod
    def unnoticed(self) -> str:
        """The verdict of a break that none of them notices."""

    @abc.abstractmethod
    def outcome(self, mutant: Mutant, unsound: Collection[str], patience: Patience) -> Outcome:
        """Run the tests in the tree as it stands, up to the first that fails or hangs.

        Args:
            mutant: the break.
            unsound: names of tests that are not to be run.
            patience: with a single test.
        """

    @abc.abstractmethod
    def known(self, name: str) -> KnownTest | None:
        """The test of that name; none if that names no test."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearby(Choice):
    """The tests of files that are near the source, without any measurement.

    Attributes:
        tree: the copy of the source tree.
        work: a folder for files that are in between.
        near: who imports whom.
        limits: how long.
        named: files that are taken in place of the nearest ones, if any.
    """

    tree: Path
    work: Path
    near: Near
    limits: Limits = field(default_factory=Limits)
    named: Sequence[str] = ()

    @property
    @override
    def unnoticed(self) -> str:
        return journal.UNSEEN

    @override
    def outcome(self, mutant: Mutant, unsound: Collection[str], patience: Patience) -> Outcome:
        files = self.named or self.near.to(mutant.file, _FILES_NEAR)
        if not files:
            return Outcome(verdict="survived", killer="", ran=0)
        return run_files(
            self.tree, self.work, files, self.limits, left_out=unsound, patience=patience
        )

    @override
    def known(self, name: str) -> KnownTest | None:
        return KnownTest(name=name, seconds=0.0) if "::" in name else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reaching(Choice):
    """The tests that reach the lines of a break, then others of their files.

    Attributes:
        tree: the copy of the source tree.
        work: a folder for files that are in between.
        reach: the tests of each line.
        budget: the time of the tests of one break, as long as they take without it [s].
    """

    tree: Path
    work: Path
    reach: Reach
    budget: float

    @property
    @override
    def unnoticed(self) -> str:
        return "survived"

    @override
    def outcome(self, mutant: Mutant, unsound: Collection[str], patience: Patience) -> Outcome:
        ran = 0
        for tests in filter(None, self._stages(mutant, unsound)):
            outcome = run(self.tree, self.work, tests, patience)
            ran += outcome.ran
            if outcome.verdict != "survived":
                return replace(outcome, ran=ran)
        return Outcome(verdict="survived", killer="", ran=ran)

    @override
    def known(self, name: str) -> KnownTest | None:
        return self.reach.tests.get(name)

    def _stages(self, mutant: Mutant, unsound: Collection[str]) -> list[list[KnownTest]]:
        """The tests: of the first files that reach the lines, of the others, and beside these.

        To read many files of tests takes longer than most breaks live.
        """
        reaching = self._reaching(mutant)
        tests = self._usable(reaching, unsound)
        first = list(dict.fromkeys(test.file for test in tests))[:_FILES_FIRST]
        return [
            [test for test in tests if test.file in first],
            [test for test in tests if test.file not in first],
            self._usable(self.reach.beside(reaching), unsound),
        ]

    def _reaching(self, mutant: Mutant) -> list[KnownTest]:
        if mutant.file.endswith(".py"):
            source = (self.tree / mutant.file).read_text("utf-8")
            at_import = runs_at_import(source, mutant.line)
            return self.reach.of(mutant.file, mutant.lines(), at_import=at_import)
        folder = Path(mutant.file).parts[1]
        if unit_of(mutant.file) is None:
            return self._in_order(mutant, {file: self.reach.of(file, ()) for file in ENGINE})
        shared = ["tests/fmus/native/"] if folder == "native" else []
        folders = [*shared, f"tests/fmus/{unit_of(mutant.file)}/test_"]
        return self._in_order(mutant, {each: self.reach.in_folder(each) for each in folders})

    def _in_order(
        self, mutant: Mutant, found: Mapping[str, Sequence[KnownTest]]
    ) -> list[KnownTest]:
        tests = {test.name: test for each in found.values() for test in each}
        return self.reach.in_order(mutant.file, list(tests.values()))

    def _usable(self, tests: Sequence[KnownTest], unsound: Collection[str]) -> list[KnownTest]:
        return within([test for test in tests if test.name not in unsound], self.budget)
