"""How the components of a run come back to a checkpoint: restored, or by stepping again."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from orchestrator.capabilities import PortableState
from orchestrator.component import Component, DecidingComponent
from orchestrator.signal import Connector
from orchestrator.system import System
from orchestrator.timebase import CommunicationGrid, StepSize, Time, as_step_size


@dataclass(frozen=True, slots=True, kw_only=True)
class Manners:
    """How a run comes back to a checkpoint.

    Attributes:
        restored: names of the components whose states are part of checkpoints.
        replayed: names of those that step again from the start, alone, with the inputs they had.
        obstacle: why there can be no checkpoints, so that all of the run is made again; empty if
            there can.
    """

    restored: tuple[str, ...]
    replayed: tuple[str, ...]
    obstacle: str = ""

    def lines(self) -> Iterator[str]:
        """What there is to say of it."""
        if self.obstacle:
            yield f"no checkpoints: {self.obstacle}; a resumed run steps again from its start"
            return
        if self.restored:
            yield f"checkpoints restore {_listed(self.restored)}"
        if self.replayed:
            yield (
                f"{_listed(self.replayed)} cannot save the state: to resume, "
                f"{'it steps' if len(self.replayed) == 1 else 'they step'} again from the start, "
                "with the inputs of then, which checkpoints have"
            )


def manners_of(system: System, *, knows_itself: bool, compiled: Collection[str] = ()) -> Manners:
    """How a run of `system` comes back to a checkpoint.

    Args:
        system: the components.
        knows_itself: whether the coupling algorithm can tell what it knows of a run.
        compiled: names of the components that compiled code steps.
    """
    restored = tuple(name for name, each in system.components.items() if _is_portable(each))
    replayed = tuple(name for name in system.components if name not in restored)
    decisions = [n for n, c in system.components.items() if isinstance(c, DecidingComponent)]
    objects = [n for n, own in system.connectors.items() if any(map(_has_objects, own.values()))]
    quick = [name for name in replayed if name in compiled]
    obstacle = ""
    if not knows_itself:
        obstacle = "the coupling algorithm cannot tell what it knows of the run"
    elif decisions:
        obstacle = f"alternatives of {_listed(decisions)} are tried in copies of the run"
    elif objects:
        obstacle = f"Python objects are exchanged by {_listed(objects)}"
    elif quick:
        obstacle = (
            f"{_listed(quick)} cannot save the state, and compiled code steps it, which nobody "
            "writes down"
        )
    elif not restored:
        obstacle = "no component can save its state"
    return Manners(restored=restored, replayed=replayed, obstacle=obstacle)


def _is_portable(component: Component) -> bool:
    return component.capability(PortableState) is not None  # type: ignore[type-abstract]


def _has_objects(connector: Connector) -> bool:
    return not connector.is_binary and np.dtype(connector.dtype).hasobject


def _listed(names: Collection[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def meeting(sizes: Collection[StepSize], start: Time, stop: Time) -> CommunicationGrid:
    """The points at which all components communicate.

    Args:
        sizes: communication step sizes [ns], each of which divides the interval.
        start: the first point [ns].
        stop: the last one [ns].
    """
    exact = [Fraction(size) for size in sizes]
    step = Fraction(
        lcm(*(size.numerator for size in exact)), gcd(*(size.denominator for size in exact))
    )
    return CommunicationGrid(start, as_step_size(step), int((stop - start) // step))
