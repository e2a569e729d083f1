"""Damaged compressed messages by the thousand, and short memory: nothing crashes, nothing leaks."""

import re
from pathlib import Path

import pytest

from tests.fmus.starving import (
    NEEDS_VALGRIND,
    build_program,
    run,
    run_in_valgrind,
    run_starved,
)


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver and the unit in one program, which stops at undefined behaviour."""
    driver = Path(__file__).parent / "native" / "damaged_messages.c"
    return build_program("perception", driver, tmp_path_factory.mktemp("damaged"))


@pytest.mark.slow
def test_damaged_messages_are_refused_or_are_matrices(program: Path) -> None:
    tried, decoded, *bad = map(int, re.findall(r"\d+", run(program, "200000")))
    assert tried == 200_000
    assert 0.1 < decoded / tried < 0.9  # both happen
    assert bad == [0, 0]


@pytest.mark.parametrize("arguments", [(), ("seen_area",)])
def test_every_allocation_may_fail(program: Path, arguments: tuple[str, ...]) -> None:
    run_starved(program, *arguments)


@NEEDS_VALGRIND
@pytest.mark.parametrize("arguments", [("3000",), ("starved",), ("starved", "seen_area")])
def test_valgrind_finds_no_error_and_no_leak(program: Path, arguments: tuple[str, ...]) -> None:
    run_in_valgrind(program, *arguments)
