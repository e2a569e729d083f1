"""The exchange of signals: the participants of a run, and when each of them is due."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from types import MappingProxyType

from orchestrator.algorithm.history import InputCourses, approximated
from orchestrator.algorithm.mixing import MixSources
from orchestrator.algorithm.participant import Participant
from orchestrator.algorithm.participants import participant
from orchestrator.algorithm.requests import Requests
from orchestrator.branching import Branching
from orchestrator.errors import SystemStructureError
from orchestrator.last_call import LastCall
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import CommunicationGrid, MultiRateGrid, StepSize, Time


@dataclass(frozen=True, slots=True)
class Wave:
    """Participants that do not read each other, so that they may step at the same time.

    Attributes:
        elsewhere: the concurrent ones.
        here: all others.
        early: concurrent ones of later waves that read nothing that is still to be published before
            their turn: they may begin with this wave.
        onward: concurrent ones that have stepped, and all of whose sources have before this wave:
            they may begin their next step, which is less urgent.
    """

    elsewhere: tuple[Participant, ...]
    here: tuple[Participant, ...]
    early: tuple[Participant, ...] = ()
    onward: tuple[Participant, ...] = ()

    def step_to(self, t: Time, *, goes_on: bool = False) -> None:
        """Let each take its step that ends at `t`, unless it has begun it already, and publish.

        Args:
            t: the communication point [ns].
            goes_on: whether steps may be begun that start there.
        """
        for each in self.elsewhere:
            if not each.is_begun:
                each.begin(each.before(t))
        for each in self.early:
            each.begin_early(each.before(t))
        if goes_on:
            for each in self.onward:
                each.begin_ahead(t)
        for each in self.here:
            each.begin(each.before(t))
        for wave in (self.elsewhere, self.here):
            for each in wave:
                each.finish()
                each.publish()


@dataclass(frozen=True, slots=True)
class Turn:
    """Participants that are due and take their turn together.

    Attributes:
        participants: in the order of the algorithm.
        waves: the same, cut in front of each that reads what the wave before it publishes.
        is_solved: whether they read each other and are to be stepped until they agree.
    """

    participants: tuple[Participant, ...]
    waves: tuple[Wave, ...]
    is_solved: bool


@dataclass(frozen=True, slots=True)
class Due:
    """Those whose steps end, or start, at one communication point.

    Attributes:
        names: in the order of the algorithm.
        participants: the same, in the same order.
        waves: the same, cut in front of each that reads what the wave before it publishes.
        turns: the same, cut around each set that is stepped until its members agree.
        elsewhere: all of the run whose steps run elsewhere, due or not, in the order of the
            algorithm.
    """

    names: tuple[str, ...]
    participants: tuple[Participant, ...]
    waves: tuple[Wave, ...]
    turns: tuple[Turn, ...]
    elsewhere: tuple[Participant, ...]


class Exchange:
    """All participants of one run, connected to each other.

    Args:
        system: the components and their connections.
        branching: takes the decisions of `DecidingComponent`s.
        last_call: where calls are noted.

    Attributes:
        participants: by name, in the order of the system.
        values: the published outputs of each component: a view of the present, which the next
            communication point changes in place. The signals themselves never change.
        requests: where components ask for the end of the run.
        sources: what inputs that are made of several outputs, or late, see of them.
    """

    __slots__ = ("participants", "requests", "sources", "values")

    def __init__(self, system: System, branching: Branching, last_call: LastCall) -> None:
        self.participants: Mapping[str, Participant] = {
            name: participant(
                name,
                branching.around(name, component),
                system.connectors[name],
                system.step_sizes[name],
            )
            for name, component in system.components.items()
        }
        last_call.begin(list(self.participants))
        self.requests = Requests()
        for number, each in enumerate(self.participants.values()):
            each.notes, each.asking.requests = last_call.notes_of(number), self.requests
        published = {name: each.published for name, each in self.participants.items()}
        for name, each in self.participants.items():
            each.inputs.connect(system.feeds[name], published)
        self.sources = MixSources(system, published)
        for name, each in self.participants.items():
            each.inputs.mix(system.mixes[name], self.sources)
            each.note_in(self.sources.histories_of(name))
        self.values: Mapping[str, Signals] = MappingProxyType(
            {name: MappingProxyType(values) for name, values in published.items()}
        )

    def approximate(self, system: System, degree: int, *, is_smooth: bool = False) -> None:
        """Let continuous real inputs run as polynomials through what was published lately.

        Args:
            system: of these participants.
            degree: of the polynomials; 0 leaves inputs held.
            is_smooth: whether each step begins with the value that the last one has ended with.
        """
        for name, each in self.participants.items():
            feeds = approximated(system, name)
            if degree > 0 and feeds:
                sources = dict.fromkeys(feed.component for feed in feeds)
                histories = {source: self.participants[source].remember() for source in sources}
                each.approximate(InputCourses(feeds, histories, degree, is_smooth=is_smooth))

    def take_turns(self, order: Sequence[str]) -> None:
        """Let components take turns in this order; each sees what those before it publish."""
        for position, name in enumerate(order):
            each = self.participants[name]
            each.take_turns(
                tuple(self.participants[n] for n in order[:position] if n in each.sources),
                tuple(self.participants[n] for n in order[position:] if n in each.sources),
            )

    def set_up(self, start: Time, stop: Time, seed: int) -> None:
        """Let every component enter its initial state."""
        self.sources.start(start)
        for name, each in self.participants.items():
            each.set_up(start, stop, stream(seed, name))

    def select(self, names: Mapping[str, frozenset[str]]) -> None:
        """Let components publish only these outputs from now on, if they can; by component."""
        for name, each in self.participants.items():
            each.select(names[name])

    def settle(self, t: Time) -> None:
        """Show all outputs at the last communication point `t` [ns].

        Steps that were begun and end beyond it are waited for.
        """
        for each in self.participants.values():
            each.settle()
        for each in self.participants.values():
            each.complete(t)


class Schedule:
    """Who is due at which communication point of a run.

    Iterating yields every communication point with those due there, stop included.

    Args:
        exchange: the participants.
        order: the names of all of them, in the order they are to take turns.
        start: the first communication point.
        stop: the last one.
        solved: sets of names that follow each other in `order` and are stepped until they agree.

    Raises:
        SystemStructureError: a step size does not divide the interval; one sentence for each.
    """

    __slots__ = ("_due_by_sizes", "_elsewhere", "_grid", "_order", "_participants", "_solved")

    def __init__(
        self,
        exchange: Exchange,
        order: Sequence[str],
        start: Time,
        stop: Time,
        solved: Sequence[frozenset[str]] = (),
    ) -> None:
        problems = []
        for name, each in exchange.participants.items():
            try:
                CommunicationGrid.over(start, stop, each.step_size)
            except ValueError as error:
                problems.append(f"component `{name}`: {error}")
        if problems:
            raise SystemStructureError(problems)
        self._order = tuple(order)
        self._solved = tuple(solved)
        self._participants = exchange.participants
        among = (exchange.participants[name] for name in order)
        self._elsewhere = tuple(each for each in among if each.is_concurrent)
        sizes = {each.step_size for each in exchange.participants.values()}
        self._grid = MultiRateGrid(start, stop, tuple(sorted(sizes)))
        self._due_by_sizes = cache(self._due)

    def __iter__(self) -> Iterator[tuple[Time, Due]]:
        return ((t, self.at(t)) for t, _ in self._grid)

    def at(self, t: Time, but: frozenset[str] = frozenset()) -> Due:
        """Those due at the communication point `t`, without some names."""
        return self._due_by_sizes(self._grid.at(t), but)

    def after(self, t: Time) -> Time:
        """The communication point after `t`, which is not the last one."""
        return self._grid.after(t)

    def _due(self, step_sizes: tuple[StepSize, ...], but: frozenset[str]) -> Due:
        names = tuple(
            name
            for name in self._order
            if self._participants[name].step_size in step_sizes and name not in but
        )
        participants = tuple(self._participants[name] for name in names)
        waves, turns = _overlapping(participants), tuple(self._turns(participants))
        return Due(names, participants, waves, turns, self._elsewhere)

    def _turns(self, participants: Sequence[Participant]) -> Iterator[Turn]:
        group_of = {name: group for group in self._solved for name in group}
        for _, due in groupby(participants, lambda each: group_of.get(each.name)):
            together = tuple(due)
            names = {each.name for each in together}
            is_solved = together[0].name in group_of and any(
                names & each.sources for each in together
            )
            yield Turn(together, tuple(_waves(together)), is_solved)


def _waves(participants: Sequence[Participant]) -> Iterator[Wave]:
    wave: list[Participant] = []
    for each in participants:
        if any(earlier.name in each.sources for earlier in wave):
            yield _wave(wave)
            wave = []
        wave.append(each)
    if wave:
        yield _wave(wave)


def _overlapping(participants: Sequence[Participant]) -> tuple[Wave, ...]:
    """The waves, and who need not wait for its own to begin a step."""
    waves = tuple(_waves(participants))
    names = [frozenset(each.name for each in (*w.elsewhere, *w.here)) for w in waves]
    early: list[list[Participant]] = [[] for _ in waves]
    onward: list[list[Participant]] = [[] for _ in (*waves, None)]
    for number, wave in enumerate(waves):
        for each in wave.elsewhere:
            read = [index for index, there in enumerate(names) if there & each.sources]
            first = max((index + 1 for index in read if index < number), default=0)
            if first < number:
                early[first].append(each)
            onward[max((number, *read)) + 1].append(each)
    return tuple(
        replace(wave, early=tuple(ahead), onward=tuple(behind))
        for wave, ahead, behind in zip(waves, early, onward[:-1], strict=True)
    )


def _wave(participants: Sequence[Participant]) -> Wave:
    return Wave(
        elsewhere=tuple(each for each in participants if each.is_concurrent),
        here=tuple(each for each in participants if not each.is_concurrent),
    )
