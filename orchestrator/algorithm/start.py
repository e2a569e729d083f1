"""Initialisation: the outputs at the first communication point, as a system of equations."""

import logging
from collections.abc import Sequence
from typing import Final

from orchestrator.algorithm.acceleration import QuasiNewton
from orchestrator.algorithm.exchange import Exchange
from orchestrator.algorithm.iteration import Tolerance, repeat
from orchestrator.algorithm.participant import Participant
from orchestrator.errors import ComponentError
from orchestrator.feedthrough import describe_path, loops, start_groups
from orchestrator.system import System
from orchestrator.timebase import Time

_log = logging.getLogger(__name__)

_TOLERANCE: Final = Tolerance(relative=1e-12, absolute=1e-12)
_MOST: Final = 100


def initialise(
    system: System, exchange: Exchange, start: Time, solved: Sequence[frozenset[str]]
) -> None:
    """Initialise and publish every component, in the order of direct feedthrough.

    Components whose outputs affect each other at the same time are evaluated until they agree, by
    interface quasi-Newton, and then initialised. Where one of them can only be initialised, or
    where they do not agree, each is initialised once, and reads of those behind it the start
    values of its inputs.

    Args:
        system: the components.
        exchange: their participants, set up.
        start: the first communication point [ns].
        solved: sets of components that the algorithm solves at all other communication points.

    Raises:
        ComponentError: a component failed; or those of an algebraic loop that is solved later do
            not agree.
    """
    for group in start_groups(system):
        participants = [exchange.participants[name] for name in group]
        is_cycle = len(group) > 1 or group[0] in participants[0].sources
        if is_cycle and all(each.can_be_tried for each in participants):
            _solve(system, participants, start, is_solved=any(set(group) <= s for s in solved))
        for each in participants:
            each.initialise(start)


def _solve(
    system: System, participants: Sequence[Participant], start: Time, *, is_solved: bool
) -> None:
    """Publish outputs that agree; nothing if they do not."""

    def sweep() -> None:
        for each in participants:
            each.try_out(start)

    found = repeat(
        participants,
        sweep,
        again=lambda: None,
        tolerance=_TOLERANCE,
        maximum=_MOST,
        acceleration=QuasiNewton(),
    )
    if found is None:
        return
    name = found.participant.name
    what = (
        f"does not agree with what it reads at the start: after {_MOST} evaluations "
        f"`{found.output}` still changes; {_where(system, name)}"
    )
    if is_solved:
        raise ComponentError(name, start, what)
    _log.warning("`%s` %s; the loop is cut there, with start values", name, what)
    for each in participants:
        each.published.clear()


def _where(system: System, name: str) -> str:
    for loop in loops(system):
        if any(end.component == name for end in (*loop.path, *loop.others)):
            return f"the algebraic loop is {describe_path(loop)}"
    return "it depends on itself"
