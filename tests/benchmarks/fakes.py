"""A benchmark that measures nothing but the order of its calls."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.spread import Spread
from orchestrator.errors import CosimError


@dataclass(frozen=True, slots=True)
class CountedCase(Case):
    """Its k-th measurement is k."""

    label: str
    journal: list[str]
    before: Callable[[int], None]

    @override
    def measure(self) -> Measurement:
        self.before(len(self.journal))
        self.journal.append(self.label)
        return {"value": self.journal.count(self.label)}


@dataclass(frozen=True, slots=True)
class CountingBenchmark(Benchmark):
    """Attributes: the cases, who was measured in turn, what happens before each."""

    names: tuple[str, ...] = ("one", "two")
    journal: list[str] = field(default_factory=list)
    before: Callable[[int], None] = lambda _: None

    @property
    @override
    def description(self) -> str:
        return "counts"

    @property
    @override
    def peer(self) -> str:
        return "a sloth"

    @override
    def cases(self) -> Mapping[str, Case]:
        return {name: CountedCase(name, self.journal, self.before) for name in self.names}

    @override
    def rows(self, measured: Mapping[str, Sequence[Measurement]]) -> Sequence[Row]:
        found = []
        for name, runs in measured.items():
            spread = Spread.of(run["value"] for run in runs)
            found.append(
                Row.of(
                    name,
                    spread,
                    "1",
                    peer=None if name == "two" else 0.5,
                    peer_name="sloth",
                    details={"runs": len(runs)},
                )
            )
        return found


class InterruptedBenchmark(CountingBenchmark):
    """The user presses Ctrl-C in front of the fourth measurement."""

    def __init__(self) -> None:
        super().__init__(before=interrupt_at(3))


class NamedBenchmark(CountingBenchmark):
    """Its cases have the name that it is told."""

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return {"name": "nobody"}

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        object.__setattr__(self, "names", (settings["name"],))


class NeedyBenchmark(CountingBenchmark):
    """Needs what is not there."""

    @override
    def require(self) -> None:
        raise CosimError("there is no sloth")


def interrupt_at(place: int) -> Callable[[int], None]:
    """Ctrl-C in front of the measurement `place`, counted from 0."""

    def interrupt(count: int) -> None:
        if count == place:
            raise KeyboardInterrupt

    return interrupt


def no_benchmark() -> str:
    """What a wrong entry point names."""
    return "nothing"
