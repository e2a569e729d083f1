"""How a file of golden data is compared: its cases, and what the channel is asked about them.

A check that compares single values says only what is its own: the cases of its file, and questions
whose answers add up to our values. `ValueCheck` does the rest.
"""

import abc
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array, Signals
from studies.verification.channel.comparison import Comparison, Exceptions, Series
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import Tolerance

Advance = Callable[[], object]
"""Is called whenever one unit of work is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check(abc.ABC):
    """Golden data that were read and found well-formed, ready to be compared.

    Attributes:
        tolerance: of what the file is mainly about.
    """

    tolerance: Tolerance

    @property
    @abc.abstractmethod
    def work(self) -> int:
        """How often `run` tells that it has advanced."""

    @abc.abstractmethod
    def run(self, channel: ChannelUnderTest, advance: Advance) -> Comparison:
        """Give the inputs to the channel and compare its outputs.

        Raises:
            ComponentError: the channel failed.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One golden value.

    Attributes:
        place: where it stands, for messages.
        golden: the value; NaN where Veins stops on an assertion.
        series: name of the curve that it belongs to in a figure.
        x: what the value depends on, if that is a single number.
        offset: what is added to the answers of the channel.
        is_excepted: whether only a finite answer is asked for.
    """

    place: str
    golden: float
    series: str
    x: float | None = None
    offset: float = 0.0
    is_excepted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Question(abc.ABC):
    """What one instance of the channel is asked.

    Attributes:
        cases: indices of the cases that the answers belong to, each once.
    """

    cases: Sequence[int]

    @abc.abstractmethod
    def ask(self, channel: ChannelUnderTest) -> Array:
        """Find our values, in the unit of the golden ones, shape (case,), in the order of `cases`.

        Raises:
            ComponentError: the channel failed.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbedLinks(Question):
    """Asks for one property of links.

    Attributes:
        probe: name of the property.
        parameters: of the instance, beside those of Veins.
        inputs: links that are there from the initialisation on, and what stands around them.
        scenes: the same of further links, one step each.
    """

    probe: str
    parameters: Mapping[str, Any]
    inputs: Signals = field(default_factory=dict)
    scenes: Sequence[Signals] = ()

    @override
    def ask(self, channel: ChannelUnderTest) -> Array:
        with channel.start({"model": "veins", **self.parameters}, self.inputs) as session:
            found = [session.probed(self.probe)]
            for scene in self.scenes:
                session.step(scene)
                found.append(session.probed(self.probe))
        return np.concatenate(found)


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueCheck(Check):
    """Single values, each compared with what the questions about it add up to.

    The tolerance is that of every value.

    Attributes:
        cases: the golden values.
        questions: to the channel; each is one unit of work.
        has_exceptions: whether the file is one that may have excepted cases.
    """

    cases: Sequence[Case]
    questions: Sequence[Question]
    has_exceptions: bool = False

    @property
    @override
    def work(self) -> int:
        return len(self.questions)

    @override
    def run(self, channel: ChannelUnderTest, advance: Advance) -> Comparison:
        ours = np.array([case.offset for case in self.cases])
        for question in self.questions:
            ours[list(question.cases)] += question.ask(channel)
            advance()
        return self._compared(ours)

    def _compared(self, ours: Array) -> Comparison:
        by_series: dict[str, list[int]] = defaultdict(list)
        excepted: list[int] = []
        for k, case in enumerate(self.cases):
            (excepted if case.is_excepted else by_series[case.series]).append(k)
        infinite = [
            f"{self.cases[k].place}: ours is {float(ours[k])}"
            for k in excepted
            if not math.isfinite(ours[k])
        ]
        return Comparison.of_values(
            self.tolerance,
            [self.cases[k].place for rows in by_series.values() for k in rows],
            [self._series(name, rows, ours) for name, rows in by_series.items()],
            mismatches=infinite,
            exceptions=self._exceptions(excepted, ours),
        )

    def _series(self, name: str, rows: Sequence[int], ours: Array) -> Series:
        cases = [self.cases[k] for k in rows]
        return Series(
            label=name,
            golden=np.array([case.golden for case in cases]),
            ours=ours[list(rows)],
            x=np.array([case.x for case in cases if case.x is not None]),
        )

    def _exceptions(self, rows: Sequence[int], ours: Array) -> Exceptions | None:
        if not self.has_exceptions:
            return None
        golden = np.array([self.cases[k].golden for k in rows])
        error = np.abs(golden - ours[list(rows)])
        return Exceptions(
            cases=len(rows),
            asserted=int(np.isnan(golden).sum()),
            equal=int((error <= self.tolerance.limit).sum()),
        )
