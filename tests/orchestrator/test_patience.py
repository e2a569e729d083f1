"""When a run that is asked to stop is given up."""

from pathlib import Path

import pytest

from orchestrator.cli import patience
from orchestrator.cli.patience import Patience
from orchestrator.last_call import CutOff


class World:
    """What the clock and the run say."""

    now = 0.0
    call: CutOff | None = CutOff("plant", "stepping", 1)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    world = World()
    monkeypatch.setattr(patience, "called", lambda _: world.call)
    monkeypatch.setattr(patience, "monotonic", lambda: world.now)
    return world


def asked(world: World, *times: float) -> Patience:
    found = Patience(lambda: Path("run"))
    for world.now in times:
        found.ask()
    return found


def test_requests_on_the_heels_of_each_other_are_one(
    world: World, capsys: pytest.CaptureFixture[str]
) -> None:
    once, twice = asked(world, 0.0, 0.05), asked(world, 0.0, 0.1)
    for each in (once, twice):
        assert each.pause == 2.0
        each.look()
    assert (once.is_over, twice.is_over) == (False, True)
    assert capsys.readouterr().err.count("`plant` was stepping at t = 1e-09 s and has not") == 1
    assert once.pause is None, "nothing to look for until the next request"


def test_a_run_that_goes_on_is_left_alone(world: World) -> None:
    found = asked(world, 0.0, 1.0)
    for time in range(2, 5):
        world.call = CutOff("plant", "stepping", time)
        found.look()
        assert not found.is_over
        assert found.pause == 2.0
    found.look()
    assert found.is_over


@pytest.mark.parametrize("call", [None, CutOff(time=3)])
def test_nobody_is_waited_for_where_no_component_is_called(
    world: World, call: CutOff | None
) -> None:
    """The run has ended, or writes its results."""
    world.call = call
    assert asked(world, 0.0, 1.0).pause is None
    assert Patience(lambda: None).pause is None


def test_a_run_that_comes_back_while_it_is_waited_for_is_left_alone(world: World) -> None:
    found = asked(world, 0.0, 1.0)
    world.call = None
    found.look()
    assert (found.is_over, found.pause) == (False, None)
