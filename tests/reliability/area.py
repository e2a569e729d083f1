"""What a part of the campaign is: cases that follow from a seed, and what became of each."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a case.

    Attributes:
        case: its number.
        kind: its row in the table, such as the codec or the way in which a file was changed.
        is_expected: whether it ended in one of the ways that are documented.
        why: what is wrong, if something is; one line.
        reproducer: one line that shows it again; the command of the campaign if empty.
        seconds: that it took [s]; 0 if nobody looked.
        peak_mb: the memory that it took at most [MB]; 0 if nobody looked.
    """

    case: int
    kind: str
    is_expected: bool
    why: str = ""
    reproducer: str = ""
    seconds: float = 0.0
    peak_mb: float = 0.0


@dataclass(frozen=True, slots=True)
class Area:
    """A part of the campaign.

    Attributes:
        name: on the command line and in the table.
        what: is done, in a sentence for the manual.
        full: the number of cases of the full campaign.
        small: the number of cases in CI.
        run: performs the cases 0 to `count` - 1 of `seed`, given as `(seed, count)`, and yields
            what became of each, in their order. A case depends on `seed` and its number only.
        some: the same of chosen cases, given as `(seed, numbers)` with ascending numbers; without
            it, those before are performed, too, where the campaign goes on or one case is asked
            for.
        needs: why it cannot run here; empty if it can.
    """

    name: str
    what: str
    full: int
    small: int
    run: Callable[[int, int], Iterator[Outcome]]
    some: Callable[[int, Sequence[int]], Iterator[Outcome]] | None = None
    needs: str = ""

    def outcomes(self, seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
        """What becomes of the cases `numbers`, which ascend."""
        if not numbers:
            return
        if self.some is not None:
            yield from self.some(seed, numbers)
            return
        wanted = set(numbers)
        for outcome in self.run(seed, numbers[-1] + 1):
            if outcome.case in wanted:
                yield outcome


def of_cases(
    name: str,
    what: str,
    *,
    full: int,
    small: int,
    some: Callable[[int, Sequence[int]], Iterator[Outcome]],
    needs: str = "",
) -> Area:
    """An area whose cases can be performed in any choice; see `Area.some`."""
    return Area(name, what, full, small, lambda seed, count: some(seed, range(count)), some, needs)
