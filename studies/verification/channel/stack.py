"""Runs of the whole Veins stack: given transmit times, then with a medium access of our own."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from typing_extensions import override

from studies.verification.channel import stack_given_times, stack_medium_access
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison
from studies.verification.channel.progress import Progress
from studies.verification.channel.reception_ratio import ratio_over_distance
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_run import StackRun, read_run
from studies.verification.channel.tolerances import STACK_POWER, Tolerance


@dataclass(frozen=True, slots=True)
class StackCheck(Check):
    """One run."""

    stack_run: StackRun
    seeds: int

    @property
    @override
    def tolerance(self) -> Tolerance:
        return STACK_POWER

    @property
    @override
    def work(self) -> int:
        own = stack_medium_access.span(self.stack_run, self.seeds)
        return stack_given_times.span(self.stack_run) + own

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        run = self.stack_run
        given, pairs = stack_given_times.compare(channel, run, progress)
        totals = stack_medium_access.compare(channel, run, self.seeds, progress)
        wrong = [
            f"{run.name}: own medium access: golden {total.golden} of outcome {letter}, ours "
            f"{total.ours.mean():.1f} +- {total.half_width:.1f} expected of one more seed"
            for letter, total in totals.items()
            if not total.passes
        ]
        own = {letter: total.as_data() for letter, total in totals.items()}
        return dataclasses.replace(
            given,
            misses=given.misses + len(wrong),
            notes=(*given.notes, *wrong),
            details={
                **given.details,
                "models": list(run.parameters.models),
                "versions": dict(run.parameters.versions),
                "own_medium_access": {"seeds": self.seeds, "totals": own},
            },
            ratios=ratio_over_distance(pairs),
        )


def read(folder: Path, seeds: int) -> StackCheck:
    """Read a run, to be repeated with so many seeds.

    Raises:
        GoldenError: it is malformed.
    """
    return StackCheck(read_run(folder), seeds)
