"""A campaign: breaks of a sample, tried one at a time, with what came of each in a journal."""

import math
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from tests.mutation import journal
from tests.mutation.areas import unit_of
from tests.mutation.building import BuildError, built, prepared
from tests.mutation.choosing import Choice
from tests.mutation.journal import Row
from tests.mutation.mutant import Mutant
from tests.mutation.reach import KnownTest
from tests.mutation.tree import broken
from tests.mutation.trial import Limits, Patience, run, run_files

_COLLECTION: Final = "collection of "
_NO_TEST: Final = Limits(all=-1.0, file=-1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """Where breaks are tried, and how long.

    Attributes:
        tree: the copy of the source tree.
        work: a folder for files that are in between.
        choice: of the tests that try a break.
        patience: with a single test.
    """

    tree: Path
    work: Path
    choice: Choice
    patience: Patience = field(default_factory=Patience)
    _sound: dict[str, bool] = field(default_factory=dict)
    _prepared: set[str | None] = field(default_factory=set)

    def tried(self, mutant: Mutant) -> Row:
        """Make the break, run the tests that reach it, and say what came of it."""
        begin = time.monotonic()
        is_c = not mutant.file.endswith(".py")
        if is_c and (unit := unit_of(mutant.file)) not in self._prepared:
            prepared(self.tree, mutant.file)
            self._prepared.add(unit)
        row = Row.of(mutant)
        with ExitStack() as stack:
            stack.enter_context(broken(self.tree, mutant))
            try:
                if is_c:
                    stack.enter_context(built(self.tree, self.work, mutant.file))
            except BuildError:
                return replace(row, verdict=journal.UNBUILT, seconds=time.monotonic() - begin)
            outcome = self.choice.outcome(mutant, self._unsound(), self.patience)
            killer = self.choice.known(outcome.killer)
            is_sure = killer is None or self._is_noticed_again(killer)
        if not (is_sure and self._is_sound(outcome.killer)):
            return self.tried(mutant)
        return replace(
            row,
            verdict=self.choice.unnoticed if outcome.verdict == "survived" else outcome.verdict,
            killer=outcome.killer,
            tests=outcome.ran,
            seconds=time.monotonic() - begin,
        )

    def _is_noticed_again(self, test: KnownTest) -> bool:
        """Whether it fails alone, too; one that failed by chance is never run again."""
        is_noticed = run(self.tree, self.work, [test], self.patience).verdict != "survived"
        if not is_noticed:
            self._sound[test.name] = False
        return is_noticed

    def _is_sound(self, killer: str) -> bool:
        """Whether it passes in the unbroken tree; one that does not is never run again."""
        if killer not in self._sound:
            self._sound[killer] = self._passes(killer)
        return self._sound[killer]

    def _passes(self, killer: str) -> bool:
        if killer.startswith(_COLLECTION):
            files = [killer.removeprefix(_COLLECTION)]
            outcome = run_files(self.tree, self.work, files, _NO_TEST, patience=self.patience)
        elif (test := self.choice.known(killer)) is not None:
            outcome = run(self.tree, self.work, [test], self.patience)
        else:
            return True
        return outcome.verdict == "survived"

    def _unsound(self) -> list[str]:
        """Tests that fail without a break, and files that cannot be read."""
        found = [name for name, is_sound in self._sound.items() if not is_sound]
        return [name.removeprefix(_COLLECTION) for name in found]


def run_all(
    attempt: Callable[[Mutant], Row],
    mutants: Sequence[Mutant],
    path: Path,
    say: Callable[[str], object] = sys.stdout.write,
    seconds: float = math.inf,
) -> list[Row]:
    """Try breaks until all have a row in the journal, or until Ctrl-C; what was tried stays.

    Args:
        attempt: tries one.
        mutants: all of them; those in the journal are not tried again.
        path: of the journal.
        say: told what came of each, and how long the rest may take.
        seconds: when none is begun any more [s].

    Returns:
        The rows of the journal that belong to these breaks.
    """
    left = list(journal.untried(journal.read(path), mutants))
    begin = time.monotonic()
    for number, mutant in enumerate(left, 1):
        if time.monotonic() - begin >= seconds:
            break
        row = attempt(mutant)
        journal.add(path, row)
        each = (time.monotonic() - begin) / number
        rest = f"{len(left) - number} left, about {_duration(each * (len(left) - number))}"
        say(f"{row.verdict:8} {row.file}:{row.line} {row.operator} ({row.seconds:.0f} s; {rest})\n")
        sys.stdout.flush()
    wanted = {mutant.key() for mutant in mutants}
    return [row for row in journal.read(path) if row.mutant.key() in wanted]


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"
