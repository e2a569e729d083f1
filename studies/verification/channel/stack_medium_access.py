"""A run of the whole stack with a medium access of our own: totals of each outcome.

Packets are handed over when they were in Veins; when they go on air depends on draws of the
backoff, and so does who collides with whom. Veins is one sample of that, and so is every seed of
ours. The golden total of each class must lie where one more sample is to be expected: within 5 s
sqrt(1 + 1/n) of the mean of our n seeds, s being their standard deviation (the prediction interval
of a normal distribution). Noise and collision (N, C) have draws at every receiver, and so always
some spread. What becomes of a frame at all its receivers otherwise may hang on one draw of a
backoff that no seed has made; in the other classes the events of one frame are never refused. One
sample of Veins makes this a weak test of the medium access: it finds a class that is systematically
too large, not a rare case that is handled differently.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_replay import replay, steps
from studies.verification.channel.stack_run import StackRun
from studies.verification.channel.tolerances import TOTALS

_DRAWN: Final = "NC"


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """The totals of one outcome.

    Attributes:
        golden: in Veins.
        ours: of each seed, shape (seed,).
        least: the half width of the interval is never smaller.
    """

    golden: int
    ours: Array
    least: float

    @property
    def half_width(self) -> float:
        """Of the interval around the mean of ours in which one more sample is to be expected."""
        n = len(self.ours)
        spread = float(self.ours.std(ddof=1)) if n > 1 else 0.0
        return max(TOTALS.limit * spread * float(np.sqrt(1 + 1 / n)), self.least)

    @property
    def passes(self) -> bool:
        """Whether the golden total lies there."""
        return abs(self.golden - float(self.ours.mean())) <= self.half_width

    def as_data(self) -> Mapping[str, Any]:
        """For `--json`."""
        return {
            "golden": self.golden,
            "mean": round(float(self.ours.mean()), 3),
            "minimum": int(self.ours.min()),
            "maximum": int(self.ours.max()),
            "half_width": round(self.half_width, 3),
            "pass": self.passes,
        }


def span(run: StackRun, seeds: int) -> int:
    """Units of progress."""
    return seeds * steps(run)


def compare(
    channel: ChannelUnderTest, run: StackRun, seeds: int, progress: Progress
) -> dict[str, Totals]:
    """The totals of every outcome over the whole run, by its letter."""
    counts = np.zeros((seeds, len(OUTCOMES)), np.int64)
    for k in range(seeds):
        own = {"medium_access": True, "weak_receptions": True, "seed": k + 1}
        for result in replay(channel, run, own, run.frames.queued):
            received = run.counted(result.receptions)
            counts[k] += np.bincount(received["outcome"], minlength=len(OUTCOMES))
            progress.advance()
    return {
        letter: Totals(
            golden=run.parameters.totals[letter],
            ours=counts[:, k],
            least=1.0 if letter in _DRAWN else len(run.names) - 1.0,
        )
        for k, letter in enumerate(OUTCOMES)
    }
