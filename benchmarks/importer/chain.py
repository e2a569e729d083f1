"""Chains of FMUs: a source, and models that give on what they get from the one before."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from benchmarks.importer.model import FACTOR, Model, Variable
from orchestrator.errors import CosimError

STEP_NS: Final = 1_000_000
"""The communication step [ns]."""

Last: TypeAlias = Mapping[str, float]
"""What the last FMU published last: output by name."""

_COUNTS: Final[Mapping[tuple[str, int], tuple[tuple[str, int], ...]]] = {
    ("matrix", 3): (("Float64", 1),),
    ("gain", 2): (("Real", 1),),
    ("gain", 3): (("Float64", 1),),
    ("feedthrough", 2): (("Real", 2), ("Integer", 1), ("Boolean", 1)),
    ("feedthrough", 3): (
        ("Float32", 1), ("Float64", 2), ("Int32", 1), ("Int64", 1), ("UInt8", 1), ("Boolean", 1)
    ),
}  # fmt: skip


class DifferentResultError(CosimError):
    """A participant came to other values than the FMUs should give. Exit code 2."""


@dataclass(frozen=True, slots=True)
class Chain:
    """A chain.

    Attributes:
        kind: of the models: `gain`, `feedthrough` or `matrix`.
        version: of FMI, 2 or 3.
        length: FMUs, the source included, at least 2.
        shape: of each variable.
    """

    kind: str
    version: int
    length: int
    shape: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        """The name of its cases and rows."""
        return f"{self.kind}-fmi{self.version}/{self.length}"

    @property
    def source(self) -> Model:
        """The first model."""
        name = f"{self.kind}_source"
        counts = _COUNTS[self.kind, self.version]
        return Model(
            name=name, version=self.version, counts=counts, is_source=True, shape=self.shape
        )

    @property
    def follower(self) -> Model:
        """All other models."""
        factor = FACTOR if self.kind == "gain" else 1.0
        counts = _COUNTS[self.kind, self.version]
        return Model(
            name=self.kind, version=self.version, counts=counts, factor=factor, shape=self.shape
        )

    @property
    def members(self) -> list[tuple[str, Model]]:
        """Names of components and their models, first to last."""
        rest = [self.follower] * (self.length - 1)
        return [(f"c{k}", model) for k, model in enumerate([self.source, *rest])]

    @property
    def wires(self) -> Iterator[tuple[str, Variable, str, Variable]]:
        """Component and output, component and input."""
        members = self.members
        for (before, first), (after, second) in itertools.pairwise(members):
            for type_, _ in first.counts:
                outputs, inputs = first.of(type_, inputs=False), second.of(type_, inputs=True)
                for output, input_ in zip(outputs, inputs, strict=True):
                    yield before, output, after, input_

    def last(self, steps: int) -> Last:
        """What the last FMU gives after the source took so many steps, from nothing."""
        found = {}
        for variable in self.follower.variables():
            if variable.is_input:
                continue
            k = int(variable.name.rpartition("_")[2])
            if variable.type in {"Real", "Float64"}:
                value: float = steps * 0.001 * k
                for _ in range(self.length - 1):
                    value = self.follower.factor * value
            elif variable.type == "Boolean":
                value = steps % 2
            else:
                value = steps % 256 if variable.type == "UInt8" else steps
            found[variable.name] = value
        return found

    def check(self, who: str, found: Last, steps: int) -> None:
        """Compare the last values.

        Args:
            who: the participant.
            found: all outputs of the last FMU.
            steps: that the source has taken when these values left it.

        Raises:
            DifferentResultError: they differ, by whatever amount.
        """
        wanted = self.last(steps)
        if dict(found) != wanted:
            raise DifferentResultError(f"{self.name}: {who} found {dict(found)}, not {wanted}")
