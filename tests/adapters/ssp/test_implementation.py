"""Which interface of an FMU a component asks for, and what a scenario says of it."""

from typing import Literal

import pytest

from adapters.ssp.implementation import NoSuchInterfaceError, chosen
from orchestrator.parameters import Parameter

BOTH = frozenset({"CoSimulation", "ModelExchange"})
CHOICE = {
    "fmi.kind": Parameter(type=Literal["co-simulation", "model-exchange"] | None, default=None)
}


@pytest.mark.parametrize(
    ("asked", "offered", "expected"),
    [
        ("any", BOTH, None),
        ("any", {"ModelExchange"}, None),
        ("CoSimulation", BOTH, None),
        ("ModelExchange", BOTH, "model-exchange"),
        ("ModelExchange", {"ModelExchange"}, None),
    ],
)
def test_a_choice_is_made_where_an_fmu_has_several(
    asked: str, offered: set[str], expected: str | None
) -> None:
    assert chosen(asked, frozenset(offered), CHOICE) == expected


@pytest.mark.parametrize(
    ("asked", "offered", "problem"),
    [
        ("CoSimulation", {"ModelExchange"}, "the FMU has no CoSimulation; it has ModelExchange"),
        ("ScheduledExecution", BOTH, "the FMU has no ScheduledExecution; it has CoSimulation, Mo"),
        (
            "ScheduledExecution",
            BOTH | {"ScheduledExecution"},
            "ScheduledExecution is not supported",
        ),
    ],
)
def test_what_an_fmu_does_not_have_is_an_error(asked: str, offered: set[str], problem: str) -> None:
    """SSP 2.0, 5.5: it is an error if the interface is not present in the FMU."""
    with pytest.raises(NoSuchInterfaceError, match=problem):
        chosen(asked, frozenset(offered), CHOICE)


def test_without_a_choice_an_interface_that_is_not_the_usual_one_is_an_error() -> None:
    with pytest.raises(NoSuchInterfaceError, match="ModelExchange is not supported here"):
        chosen("ModelExchange", BOTH, {})
