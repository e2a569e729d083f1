"""Branches: copies of a running simulation in which alternatives are tried.

A branch is a copy of the process (`fork`), and so of everything: simulators, the memory of FMUs,
Python objects, random states. No component has to be restorable. A branch goes on where it was
copied, in the middle of the step that opened the decision, and simulates to the horizon, or until
the run is over there. It has no observers, writes its score into a pipe and ends. The trunk, which
is the run itself, waits for one branch after the other and then takes the best alternative. It is
the same run as if it had known that alternative from the start.
"""

import json
import logging
import math
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NoReturn

from typing_extensions import override

from orchestrator.capabilities import Redrawing
from orchestrator.component import (
    Component,
    ConcurrentComponent,
    DecidingComponent,
    Decision,
    WrappedComponent,
)
from orchestrator.contest import Standings, contest
from orchestrator.errors import ComponentError, SystemStructureError, in_words
from orchestrator.fork import Fork
from orchestrator.randomness import redrawn
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import Duration, Time, seconds

_log = logging.getLogger(__name__)


def branching_problems(system: System, deciding: Iterable[str]) -> list[str]:
    """Why the decisions of the components `deciding` cannot be tried; empty if they can.

    Args:
        system: the components.
        deciding: names of components that are, here or in another process, `DecidingComponent`s.
    """
    elsewhere = [
        name
        for name, component in system.components.items()
        if isinstance(component, ConcurrentComponent)
    ]
    return [problem for name in deciding for problem in copying_problems(name, elsewhere)]


def copying_problems(name: str, elsewhere: Sequence[str]) -> list[str]:
    """Why the decisions of the component `name` cannot be tried; empty if they can.

    Args:
        name: of a component that is a `DecidingComponent`.
        elsewhere: names of those that step outside of this process.
    """
    problems = []
    what = f"component `{name}` tries its alternatives in copies of this process"
    if sys.platform == "win32":
        problems.append(f"{what}, which Windows cannot make; run it on Linux")
    if elsewhere:
        others = ", ".join(f"`{other}`" for other in elsewhere)
        verb = "steps" if len(elsewhere) == 1 else "step"
        problems.append(
            f"{what}, but {others} {verb} outside of it and would not be copied; run all "
            "components in one process: `--transport in-process`"
        )
    return problems


@dataclass(slots=True, kw_only=True)
class _Branch:
    """What a copy knows about itself.

    Attributes:
        name: of the component that decides.
        component: the same.
        horizon: where the branch ends [ns].
        best: the score it has to beat; `None` for the first.
        trunk: the process that waits for it.
        pipe: takes the outcome.
        is_bounded: whether the component still speaks of this decision when it gives a bound.
    """

    name: str
    component: DecidingComponent
    horizon: Time
    best: float | None
    trunk: int
    pipe: int
    is_bounded: bool = True

    def check(self, t: Time, *, is_last: bool) -> None:
        """End if nothing more is to be learnt, or if nobody waits any more."""
        if os.getppid() != self.trunk:
            os._exit(1)
        if is_last or t >= self.horizon:
            self.end(score=_score_of(self.name, self.component, t))
        if self.is_bounded and _is_beaten(self.component, self.horizon, self.best):
            self.end(score=None)

    def fail(self, t: Time, error: BaseException) -> NoReturn:
        """Tell the trunk what went wrong."""
        if isinstance(error, ComponentError):
            self.end(component=error.component, time=error.time, error=error.message)
        self.end(component=self.name, time=t, error=in_words(error))

    def end(self, **outcome: Any) -> NoReturn:
        """Leave, without any of what Python does at the end of a process."""
        try:
            os.write(self.pipe, json.dumps(outcome).encode())
        finally:
            os._exit(0)


class Branching:
    """The decisions of one run.

    Args:
        system: its components.
        stop: the last communication point [ns], if no output ends the run before.
        seed: of the run.

    Raises:
        SystemStructureError: there is a `DecidingComponent`, and the system cannot be copied.
    """

    def __init__(self, system: System, stop: Time, seed: int) -> None:
        deciding = [n for n, c in system.components.items() if isinstance(c, DecidingComponent)]
        problems = branching_problems(system, deciding)
        if problems:
            raise SystemStructureError(problems)
        self._has_decisions = bool(deciding)
        self._redrawing: dict[str, Redrawing] = {}
        for name, component in system.components.items():
            chance = component.capability(Redrawing)  # type: ignore[type-abstract]
            if chance is not None:
                self._redrawing[name] = chance
        self._seed = seed
        self._stop = stop
        self._time: Time = 0
        self._branch: _Branch | None = None

    @property
    def has_decisions(self) -> bool:
        """Whether any component decides by trying."""
        return self._has_decisions

    @property
    def is_trunk(self) -> bool:
        """Whether this is the run itself and not a branch of it."""
        return self._branch is None

    def around(self, name: str, component: Component) -> Component:
        """`component` as the exchange is to see it: with every decision taken."""
        if isinstance(component, DecidingComponent):
            return _Decided(name, component, self)
        return component

    def arrive(self, t: Time, *, is_last: bool) -> None:
        """The communication point `t` is reached; a branch ends at its horizon or the last one."""
        self._time = t
        if self._branch is not None:
            self._branch.check(t, is_last=is_last)

    @contextmanager
    def confined(self) -> Iterator[None]:
        """Let no error of a branch get any further than to the trunk."""
        try:
            yield
        except BaseException as error:
            if self._branch is not None:
                self._branch.fail(self._time, error)
            raise

    def best(self, name: str, component: DecidingComponent, decision: Decision, now: Time) -> int:
        """The alternative to take: the best in the trunk, and in a branch its own.

        Args:
            name: of the component.
            component: undecided.
            decision: what is open.
            now: the time the component has reached [ns].

        Raises:
            ComponentError: a branch failed, or could not be made.
        """
        if not decision.alternatives:
            raise ComponentError(name, now, "opened a decision without alternatives")
        if self._branch is not None:
            self._branch.is_bounded &= component is not self._branch.component
            return 0
        if len(decision.alternatives) == 1:
            return 0
        horizon = min(decision.horizon, self._stop)
        labels, score = decision.alternatives, None
        trials = contest(len(labels), decision.draws, component.score_bound(horizon))
        if decision.draws and not self._redrawing:
            raise ComponentError(name, now, "wants chance redrawn, which no component here can")
        try:
            trial = next(trials)
            while True:
                if _is_beaten(component, horizon, trial.to_beat):
                    trial = trials.send(None)
                    continue
                trunk, fork = os.getpid(), _fork(name, now)
                if fork.is_copy:
                    self._branch = _Branch(
                        name=name,
                        component=component,
                        horizon=horizon,
                        best=trial.to_beat,
                        trunk=trunk,
                        pipe=fork.answer,
                    )
                    fork.enter()  # from here on, errors are the branch's
                    self._redraw(now, trial.draw)
                    return trial.alternative
                what = f"`{labels[trial.alternative]}`, tried by `{name}` at {_at(now)}"
                score = _outcome(fork, what, name, now)
                trial = trials.send(score)
        except StopIteration as end:
            standings: Standings = end.value
        _log.info("%s", _account(name, decision, standings, now))
        return standings.winner

    def _redraw(self, now: Time, draw: int | None) -> None:
        """Let what is still to be drawn be drawn anew, unless `draw` is `None`."""
        if draw is None:
            return
        for name, component in self._redrawing.items():
            component.redraw(redrawn(self._seed, name, now, draw))


def _is_beaten(component: DecidingComponent, horizon: Time, best: float | None) -> bool:
    return best is not None and component.score_bound(horizon) <= best


def _fork(name: str, now: Time) -> Fork:
    try:
        return Fork()
    except OSError as error:
        what = f"this process cannot be copied to try an alternative: {error.strerror}"
        raise ComponentError(name, now, what) from error


def _outcome(fork: Fork, what: str, name: str, now: Time) -> float | None:
    """The score of a branch; `None` if it could not beat the best before it."""
    answer = fork.wait()
    if not answer:
        raise ComponentError(name, now, f"the branch of {what}, {fork.ending}")
    outcome = json.loads(answer)
    if "error" in outcome:
        message = f"{outcome['error']} (in the branch of {what})"
        raise ComponentError(outcome["component"], outcome["time"], message)
    score: float | None = outcome["score"]
    return score


def _at(t: Time) -> str:
    return f"t = {seconds(t):.9g} s"


def _account(name: str, decision: Decision, standings: Standings, now: Time) -> str:
    outcomes = (
        f"{label} {'pruned' if score is None else f'{score:g}'}"
        + (f" ({trials})" if decision.draws else "")
        for label, score, trials in zip(
            decision.alternatives, standings.scores, standings.trials, strict=True
        )
    )
    return f"`{name}` decided at {_at(now)}: {', '.join(outcomes)}"


def _score_of(name: str, component: DecidingComponent, t: Time) -> float:
    score = float(component.score())
    if math.isnan(score):
        raise ComponentError(name, t, "its score is NaN; it cannot be compared")
    return score


class _Decided(WrappedComponent):
    """A deciding component whose decisions are taken before anybody sees its outputs."""

    def __init__(self, name: str, component: DecidingComponent, branching: Branching) -> None:
        super().__init__(component)
        self._name = name
        self._component = component
        self._branching = branching

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._component.step(inputs, t, h)
        decision = self._component.decision
        if decision is not None:
            best = self._branching.best(self._name, self._component, decision, t + h)
            self._component.decide(best)
