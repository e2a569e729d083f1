"""How old the value is that a step has used when it ends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from orchestrator.system import System
from orchestrator.timebase import Duration, StepSize, common


@dataclass(frozen=True, slots=True, kw_only=True)
class Age:
    """The least and the greatest age of the values that travel along one connection.

    Communication points of source and target meet at multiples of the greatest common divisor of
    their step sizes, so with different step sizes the age differs from step to step.

    Attributes:
        youngest: at the end of the target's step, at best [ns]; 0 is no delay.
        oldest: at worst [ns].
    """

    youngest: StepSize
    oldest: StepSize

    @classmethod
    def newest(cls, source: StepSize, target: StepSize) -> "Age":
        """The age of what was published at or before the point where the target's step ends.

        Args:
            source: communication step size of the component that writes [ns].
            target: of the component that reads [ns].
        """
        return cls(youngest=0, oldest=source - common(source, target))

    @classmethod
    def previous(cls, source: StepSize, target: StepSize) -> "Age":
        """The age of what was published before the point where the target's step ends.

        Args:
            source: communication step size of the component that writes [ns].
            target: of the component that reads [ns].
        """
        return cls(youngest=common(source, target), oldest=source)

    @classmethod
    def held(cls, source: StepSize, target: StepSize) -> "Age":
        """The age of what was published at or before the point where the target's step starts.

        Args:
            source: communication step size of the component that writes [ns].
            target: of the component that reads [ns].
        """
        return cls(youngest=target, oldest=target + source - common(source, target))

    @classmethod
    def delayed(
        cls, source: StepSize, target: StepSize, delay: Duration, *, reads_at_start: bool
    ) -> "Age":
        """The age of what was published at the latest `delay` before the target reads.

        Args:
            source: communication step size of the component that writes [ns].
            target: of the component that reads [ns].
            delay: positive [ns].
            reads_at_start: whether the target reads where its step starts, not where it ends.
        """
        shared = common(source, target)
        youngest = delay + -delay % shared + (target if reads_at_start else 0)
        return cls(youngest=youngest, oldest=youngest + source - shared)

    def sampled(self, sample: StepSize, target: StepSize) -> "Age":
        """The age of a value that the target reads now and then, and holds.

        Args:
            sample: how often it is read, a multiple of `target` [ns].
            target: communication step size of the component that reads [ns].
        """
        return Age(youngest=self.youngest, oldest=self.oldest + sample - target)


def ages_by_turn(
    system: System, turns: Sequence[str], solved: Sequence[frozenset[str]] = ()
) -> Mapping[tuple[str, str], Age]:
    """The ages where components take turns and see the newest outputs of those before them.

    Args:
        system: the components and their connections.
        turns: the order of the components.
        solved: sets of components that see the newest outputs of each other, whatever the order.

    Returns:
        For each pair of a source and a target that are connected: the age.
    """
    turn = {name: index for index, name in enumerate(turns)}
    found = {}
    for source, target in connected(system):
        sizes = system.step_sizes[source], system.step_sizes[target]
        is_forward = turn[source] < turn[target]
        is_solved = any({source, target} <= names for names in solved)
        found[source, target] = (
            Age.newest(*sizes) if is_forward or is_solved else Age.previous(*sizes)
        )
    return found


def connected(system: System) -> Sequence[tuple[str, str]]:
    """The pairs of components of which the first drives an input of the second, each once."""
    pairs = ((link.source.component, link.target.component) for link in system.connections)
    return tuple(dict.fromkeys(pairs))
