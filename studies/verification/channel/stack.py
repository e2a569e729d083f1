"""Runs of the whole Veins stack: with given transmit times, and with a medium access of our own.

*Medium access of our own.* Packets are handed over when they were in Veins; when they go on air
depends on draws of the backoff, and so does who collides with whom. Veins is one sample of that,
and so is every seed of ours. The golden total of each class must lie where one more sample is to be
expected: within 5 s sqrt(1 + 1/n) of the mean of our n seeds, s being their standard deviation (the
prediction interval of a normal distribution). Noise and collision (N, C) have draws at every
receiver, and so always some spread. What becomes of a frame at all its receivers otherwise may hang
on one draw of a backoff that no seed has made; in the other classes the events of one frame are
never refused. One sample of Veins makes this a weak test of the medium access: it finds a class
that is systematically too large, not a rare case that is handled differently.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import OUTCOMES
from studies.verification.channel.check import Advance, Check
from studies.verification.channel.comparison import Comparison, StackFindings, Totals
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_given_times import with_given_times
from studies.verification.channel.stack_replay import ratio_over_distance, replay, steps
from studies.verification.channel.stack_run import StackRun, read_run
from studies.verification.channel.tolerances import STACK_POWER

_DRAWN: Final = "NC"


@dataclass(frozen=True, slots=True, kw_only=True)
class StackCheck(Check):
    """One run, once with given transmit times and with several seeds of a medium access."""

    stack_run: StackRun
    seeds: int

    @property
    @override
    def work(self) -> int:
        return (1 + self.seeds) * steps(self.stack_run)

    @override
    def run(self, channel: ChannelUnderTest, advance: Advance) -> Comparison:
        run = self.stack_run
        given = with_given_times(channel, run, advance)
        totals = with_own_access(channel, run, self.seeds, advance)
        wrong = [
            f"{run.name}: own medium access: golden {total.golden} of outcome {letter}, ours "
            f"{total.ours.mean():.1f} +- {total.half_width:.1f} expected of one more seed"
            for letter, total in totals.items()
            if not total.passes
        ]
        return dataclasses.replace(
            given.comparison,
            misses=given.comparison.misses + len(wrong),
            notes=(*given.comparison.notes, *wrong),
            stack=StackFindings(
                snir_error=given.snir_error,
                snir_excepted=given.snir_excepted,
                received=given.received,
                outcomes=given.outcomes,
                models=run.parameters.models,
                versions=run.parameters.versions,
                seeds=self.seeds,
                totals=totals,
                ratios=ratio_over_distance(given.pairs),
            ),
        )


def read_stack(folder: Path, seeds: int) -> StackCheck:
    """Read a run, to be repeated with so many seeds.

    Raises:
        GoldenError: it is malformed.
    """
    return StackCheck(tolerance=STACK_POWER, stack_run=read_run(folder), seeds=seeds)


def with_own_access(
    channel: ChannelUnderTest, run: StackRun, seeds: int, advance: Advance
) -> dict[str, Totals]:
    """Count every outcome over the whole run with each seed; totals by the outcome's letter.

    Raises:
        ComponentError: the channel failed.
    """
    counts = np.zeros((seeds, len(OUTCOMES)), np.int64)
    for k in range(seeds):
        own = {"medium_access": True, "weak_receptions": True, "seed": k + 1}
        for result in replay(channel, run, own, run.frames.queued):
            received = run.counted(result.receptions)
            counts[k] += np.bincount(received["outcome"], minlength=len(OUTCOMES))
            advance()
    return {
        letter: Totals(
            golden=run.parameters.totals[letter],
            ours=counts[:, k],
            least=1.0 if letter in _DRAWN else len(run.names) - 1.0,
        )
        for k, letter in enumerate(OUTCOMES)
    }
