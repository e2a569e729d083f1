"""Nothing leaks, nothing is read that was never written, and short memory is an error."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from tests.fmus.starving import (
    NEEDS_VALGRIND,
    build_program,
    run,
    run_in_valgrind,
    run_starved,
)

pytestmark = pytest.mark.slow

FMUS: Final = Path(__file__).parent.parent


@dataclass(frozen=True, slots=True, kw_only=True)
class Life:
    """A program in which instances of a unit live.

    Attributes:
        unit: its name.
        driver: the C file that makes the program; it prints what was seen, then what went wrong.
        sees: the least that must be seen, number by number.
        starves_in_valgrind: whether valgrind watches it with short memory, too: where every
            seventh allocation fails, as it takes long.
    """

    unit: str
    driver: str
    sees: tuple[int, ...]
    starves_in_valgrind: bool = False


LIVES: Final = (
    Life(unit="channel", driver="busy", sees=(1001, 1001)),
    Life(unit="lidar", driver="scanning", sees=(20_001,)),
    Life(unit="perception", driver="sighted", sees=(11, 2), starves_in_valgrind=True),
)


@pytest.fixture(scope="module", params=LIVES, ids=lambda life: life.unit)
def life(request: pytest.FixtureRequest) -> Life:
    found: Life = request.param
    return found


@pytest.fixture(scope="module")
def program(life: Life, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour."""
    driver = FMUS / life.unit / "native" / f"{life.driver}.c"
    return build_program(life.unit, driver, tmp_path_factory.mktemp(life.driver))


def test_a_life_without_undefined_behaviour(life: Life, program: Path) -> None:
    numbers = list(map(int, re.findall(r"\d+", run(program))))
    seen, wrong = numbers[: len(life.sees)], numbers[len(life.sees) :]
    assert all(number >= least for number, least in zip(seen, life.sees, strict=True)), seen
    assert wrong
    assert not any(wrong)


def test_every_allocation_of_a_unit_may_fail(program: Path) -> None:
    run_starved(program)


def test_every_allocation_of_the_shell_may_fail(tmp_path: Path) -> None:
    driver = Path(__file__).parent / "starved.c"
    run_starved(build_program(str(FMUS / "units" / "lag"), driver, tmp_path))


@pytest.mark.slow
@NEEDS_VALGRIND
def test_valgrind_finds_no_error_and_no_leak(life: Life, program: Path) -> None:
    run_in_valgrind(program)
    if life.starves_in_valgrind:
        run_in_valgrind(program, "starved", "7")
