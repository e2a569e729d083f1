"""An algorithm that leaves somebody out is refused: a run of nothing would look like any other."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pytest
from typing_extensions import override

from orchestrator.algorithm.age import Age
from orchestrator.algorithm.base import CosimulationAlgorithm, ages_of, turns_of
from orchestrator.algorithm.exchange import Due
from orchestrator.errors import SystemStructureError
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Time
from tests.orchestrator.test_algorithm import coupled

STEP = 100_000_000


def pair() -> System:
    return coupled({"left": STEP, "right": STEP})


@dataclass(frozen=True, slots=True)
class Negligent(CosimulationAlgorithm):
    """Steps, and publishes, those that it is told to."""

    steps: tuple[str, ...] = ("left", "right")
    publishes: tuple[str, ...] = ("left", "right")
    order: tuple[str, ...] = ("left", "right")
    known: tuple[tuple[str, str], ...] = (("left", "right"),)

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        return self.order

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        return {each: Age(youngest=0, oldest=STEP) for each in self.known}

    @override
    def arrive(self, t: Time, due: Due) -> None:
        for each in due.participants:
            if each.name in self.steps:
                each.begin(t - STEP)
                each.finish()
            if each.name in self.publishes:
                each.publish()


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"steps": ()}, "did not let `left` step at t = 0.1 s"),
        ({"steps": ("right",), "publishes": ("right",)}, "did not let `left` step at t = 0.1 s"),
        ({"publishes": ("left",)}, "did not let `right` publish at t = 0.1 s"),
        ({"order": ("left",)}, "`Negligent.turns` gave `left`; each of `left`, `right` has one"),
        ({"order": ("left", "left")}, "gave `left`, `left`; each of"),
        ({"order": ()}, "gave nothing; each of"),
        ({"order": 7}, "gave `7`; each of"),
    ],
)
def test_who_is_left_out_is_named(settings: dict[str, Any], complaint: str) -> None:
    with pytest.raises(SystemStructureError) as caught:
        simulate(pair(), Negligent(**settings), start=0, stop=5 * STEP, seed=0)
    assert complaint in str(caught.value)


def test_who_leaves_nobody_out_runs_to_the_end() -> None:
    assert simulate(pair(), Negligent(), start=0, stop=5 * STEP, seed=0).time == 5 * STEP
    assert turns_of(Negligent(), pair()) == ("left", "right")


def test_a_connection_without_an_age_is_named() -> None:
    what = r"`Negligent.ages` says nothing of the values from `right` to `left`"
    with pytest.raises(SystemStructureError, match=what):
        ages_of(Negligent(), pair())
