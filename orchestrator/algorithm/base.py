"""The interface of a co-simulation algorithm."""

import abc
import enum
from collections.abc import Iterable, Mapping
from typing import Any, Final

from typing_extensions import override

from orchestrator.algorithm.age import Age
from orchestrator.algorithm.exchange import Due, Exchange
from orchestrator.errors import SystemStructureError
from orchestrator.installed import installed_class, offers
from orchestrator.parameters import Parametrised
from orchestrator.system import System
from orchestrator.timebase import StepSize, Time

GROUP: Final = "orchestrator.algorithms"
"""Entry points by the name that scenarios write: subclasses of `CosimulationAlgorithm`."""


class Pattern(enum.Enum):
    """How an algorithm lets components step, where compiled code can take it over."""

    PARALLEL = "parallel"
    """All begin at a communication point with what is published there, and publish at the end."""

    SEQUENTIAL = "sequential"
    """Where steps end, each is made and published in turn, with what is published then."""


class Stepping(abc.ABC):
    """Lets the participants of one run step."""

    def look_ahead(self, t: Time, due: Due) -> None:
        """Start steps elsewhere that start at `t`, so that they go on while `t` is observed.

        Nobody fails here: what goes wrong is raised where the step is waited for. By default
        nothing is started.
        """

    def depart(self, t: Time, due: Due) -> None:
        """Start the steps that start at `t`, unless `arrive` makes whole steps."""

    @abc.abstractmethod
    def arrive(self, t: Time, due: Due) -> None:
        """Complete the steps that end at `t` and publish their outputs."""

    def pass_by(self, t: Time, due: Due) -> None:
        """`arrive`, where the run goes on unless an output or a component says otherwise.

        Steps elsewhere that start at `t` may be started, as in `look_ahead`, as soon as all that is
        read there is published. By default none is.
        """
        self.arrive(t, due)

    def memory(self) -> Any | None:
        """What it knows of the run so far, as `orchestrator.packing` takes it.

        Asked for at communication points of all components, where no step is under way.

        Returns:
            `None`, the default, if that cannot be told: such a run can be resumed only by stepping
            again from its start.
        """
        return None

    def recall(self, memory: Any) -> None:
        """Know what `memory` told, in place of all else; called on what `of_run` made anew."""
        del memory

    def tally(self) -> Mapping[str, int]:
        """What is to be told of the run so far, counted, by a word for each; nothing by default."""
        return {}


class CosimulationAlgorithm(Parametrised, Stepping):
    """Decides who steps when, and which values it sees.

    An algorithm is a frozen dataclass; its fields, each made with `parameter`, are what a scenario
    may say beside `algorithm` under `coupling`. It is immutable and keeps no state of a run; one
    that needs some returns another object in `of_run`. At every communication point `t` the
    simulation calls `arrive` or `pass_by` with those whose steps end at `t` (not at the first
    point), calls `look_ahead` with those whose steps start at `t` (not at the last point; they are
    the same, as every step starts where the last ended), shows the published outputs to the
    observers, and calls `depart` with those whose steps start at `t`.

    A participant's step takes three calls: `begin` reads its inputs as published now and starts,
    `finish` waits for the end and checks the outputs, `publish` shows them to others. Every
    participant that is due must have been begun, finished and published once when `arrive`
    returns; in between it may be taken back by `restore` to what `save` gave, and step again.
    """

    @override
    def memory(self) -> Any | None:
        return {}  # it keeps no state of a run

    @property
    def pattern(self) -> Pattern | None:
        """What `depart` and `arrive` amount to, if it is one of these; else they are called."""
        return None

    @abc.abstractmethod
    def turns(self, system: System) -> tuple[str, ...]:
        """The order in which the components of `system` take turns, each named once.

        Called once, before the run.

        Raises:
            SystemStructureError: the algorithm cannot be applied to `system`.
        """

    def solved(self, system: System) -> tuple[frozenset[str], ...]:
        """Sets of components that are stepped together until they agree; none by default.

        Those of a set follow each other in `turns`.
        """
        del system
        return ()

    @abc.abstractmethod
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        """How old values are when the step that used them ends.

        Returns:
            The age for each pair of a source and a target that are connected.
        """

    def lags(self, system: System) -> Mapping[str, StepSize]:
        """How old the inputs are of which published outputs with direct feedthrough are, if at all.

        Returns:
            By component [ns], without those whose outputs are those of the inputs at that time.
        """
        del system
        return {}

    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        """What is called at the communication points of a run; this algorithm by default.

        Called once for each run, before its first communication point.

        Args:
            system: the components and their connections.
            exchange: their participants.
        """
        del system, exchange
        return self


def turns_of(algorithm: CosimulationAlgorithm, system: System) -> tuple[str, ...]:
    """The order that `algorithm` gives the components of `system`, each named once.

    Raises:
        SystemStructureError: it cannot be applied to `system`, or names others.
    """
    given: Any = algorithm.turns(system)
    found = tuple(given) if isinstance(given, Iterable) else (given,)
    if sorted(map(str, found)) != sorted(system.components):
        name = type(algorithm).__name__
        wanted, named = (", ".join(f"`{e}`" for e in names) for names in (system.components, found))
        what = f"`{name}.turns` gave {named or 'nothing'}; each of {wanted} has one turn"
        raise SystemStructureError([what])
    return found


def ages_of(algorithm: CosimulationAlgorithm, system: System) -> Mapping[tuple[str, str], Age]:
    """What `algorithm` says of the ages of values, for all that is connected in `system`.

    Raises:
        SystemStructureError: it leaves a pair out.
    """
    found = algorithm.ages(system)
    missing = sorted(
        {(link.source.component, link.target.component) for link in system.connections} - set(found)
    )
    if missing:
        pairs = ", ".join(f"`{source}` to `{target}`" for source, target in missing)
        name = type(algorithm).__name__
        raise SystemStructureError([f"`{name}.ages` says nothing of the values from {pairs}"])
    return found


def check_published(stepping: Stepping, t: Time, due: Due) -> None:
    """Refuse an algorithm that has left out what was due.

    Raises:
        SystemStructureError: somebody whose step ends at `t` did not step, or nobody sees it.
    """
    missed = [what for each in due.participants if (what := each.was_left_behind(t))]
    if missed:
        name = type(stepping).__name__
        raise SystemStructureError([f"the coupling algorithm `{name}` {what}" for what in missed])


def installed() -> Mapping[str, str]:
    """The algorithms that packages offer: by name, where each comes from."""
    return offers(GROUP)


def algorithm_type(name: str) -> type[CosimulationAlgorithm]:
    """Load the algorithm called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    base, noun = CosimulationAlgorithm, "coupling algorithm"
    return installed_class(GROUP, name, base, noun)  # type: ignore[type-abstract]
