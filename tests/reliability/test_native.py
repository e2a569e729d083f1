"""Episodes follow from their numbers, and what a sanitizer finds is told with its place."""

from functools import partial
from pathlib import Path
from typing import Final

import pytest

from fmus.native.unit import UNITS
from tests.reliability.area import Outcome
from tests.reliability.episodes.calls import Calls, Table, What
from tests.reliability.episodes.lives import episode
from tests.reliability.native import ENGINE, Player, unit_player

UNIT: Final = "lidar"


@pytest.mark.parametrize("unit", UNITS)
def test_an_episode_follows_from_seed_and_number(unit: str) -> None:
    table = Table(unit)
    found = [episode(table, seed, case) for seed, case in ((1, 2), (1, 2), (1, 3), (2, 2))]
    assert found[0] == found[1]
    assert len(set(found)) == 3


@pytest.fixture(scope="module")
def player(tmp_path_factory: pytest.TempPathFactory) -> Player:
    return unit_player(UNIT, tmp_path_factory.mktemp(UNIT))


@pytest.mark.slow
def test_lives_end_as_they_should_and_most_get_past_the_checks(player: Player) -> None:
    outcomes = [player.play(1, case) for case in range(30)]
    player.close()
    assert [o.why for o in outcomes if not o.is_expected] == []
    assert sum(o.kind == f"{UNIT}, stepped" for o in outcomes) > 15
    assert {o.case for o in outcomes} == set(range(30))


@pytest.mark.slow
def test_what_goes_wrong_is_told_and_the_next_episode_is_played(
    player: Player, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut_short(table: Table, seed: int, case: int) -> bytes:
        calls = Calls(table)
        calls.add(What.NEW)
        whole = calls.bytes(case)
        return whole if case else whole.replace(b"\0\0\0\0\x01", b"\0\0\0\0\xff", 1) + bytes(50)

    monkeypatch.setattr(player, "_episode_of", partial(cut_short, Table(UNIT)))
    monkeypatch.setattr("tests.reliability.native.LONGEST", 2.0)
    lost, sound = player.play(1, 0), player.play(1, 1)
    player.close()
    assert (lost.is_expected, lost.why) == (False, "not done after 2 s")
    assert sound == Outcome(
        1, f"{UNIT}, refused before a step", is_expected=True, seconds=sound.seconds,
        peak_mb=sound.peak_mb,
    )  # fmt: skip


def test_the_driver_and_the_author_number_calls_alike() -> None:
    text = (Path(__file__).parent / "episodes" / "player.c").read_text()
    (names,) = [line for line in text.splitlines() if line.startswith("enum { NEW")]
    assert names == f"enum {{ {', '.join(what.name for what in What)} }};"


@pytest.mark.slow
def test_plans_of_the_engine_end_as_they_should() -> None:
    outcomes = list(ENGINE.run(1, 100))
    assert [o.why for o in outcomes if not o.is_expected] == []
    assert sum(o.kind == "engine, stepped" for o in outcomes) > 70
