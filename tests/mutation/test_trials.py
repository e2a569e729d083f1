"""Breaks are told apart: one that a test notices, one that none does, one that hangs."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.mutation import journal
from tests.mutation.__main__ import _options, _try_all
from tests.mutation.campaign import Campaign, run_all
from tests.mutation.choosing import Nearby, Reaching
from tests.mutation.journal import Row
from tests.mutation.mutant import Mutant, StaleMutantError
from tests.mutation.near import Near
from tests.mutation.reach import KnownTest, Reach
from tests.mutation.tree import broken
from tests.mutation.trial import Limits, Patience, run, run_files

SOURCE = """\
def total(limit: int) -> int:
    found, number = 0, 0
    while number < limit:
        number += 1
        found += number
    spare = 7
    return found
"""
CHECKS = """\
from sums import total

def test_gauss():
    assert total(100) == 5050

def test_nothing():
    assert total(0) == 0
"""
LOSES = {"before": "        found += number", "after": "        found -= number", "line": 5}
IDLE = {"before": "    spare = 7", "after": "    spare = 8", "line": 6}
HANGS = {"before": "        number += 1", "after": "        number += 0", "line": 4}


def mutant(**what: object) -> Mutant:
    return Mutant(area="kernel", file="sums.py", operator="by hand", **what)  # type: ignore[arg-type]


def checks(*names: str, seconds: float = 0.01) -> list[KnownTest]:
    return [KnownTest(name=f"checks/test_sums.py::{name}", seconds=seconds) for name in names]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A tree with a module of one function, and two tests of it."""
    tree = tmp_path / "tree"
    (tree / "checks").mkdir(parents=True)
    (tree / "sums.py").write_text(SOURCE)
    (tree / "checks" / "test_sums.py").write_text(CHECKS)
    (tree / "pytest.ini").write_text("[pytest]\naddopts = --import-mode=importlib\n")
    return tree


@pytest.fixture
def campaign(tree: Path, tmp_path: Path) -> Campaign:
    """Both tests are known to reach every line."""
    work = tmp_path / "work"
    work.mkdir()
    tests = checks("test_gauss", "test_nothing")
    reach = Reach(
        tests={test.name: test for test in tests},
        lines={"sums.py": {line: [t.name for t in tests] for line in range(1, 8)}},
    )
    patience = Patience(least=120.0, factor=1.0)
    choice = Reaching(tree=tree, work=work, reach=reach, budget=60.0)
    return Campaign(tree=tree, work=work, choice=choice, patience=patience)


@pytest.fixture
def nearby(campaign: Campaign) -> Campaign:
    """Nothing is known but who imports whom."""
    near = Near({"checks/test_sums.py": frozenset(["sums.py"]), "sums.py": frozenset()})
    choice = Nearby(tree=campaign.tree, work=campaign.work, near=near)
    return replace(campaign, choice=choice)


@pytest.mark.slow
def test_a_break_that_a_test_notices_is_killed_by_it(campaign: Campaign) -> None:
    row = campaign.tried(mutant(**LOSES))
    assert (row.verdict, row.killer) == ("killed", "checks/test_sums.py::test_gauss")
    assert row.tests == 1  # the other was not needed


@pytest.mark.slow
def test_files_that_are_named_take_the_place_of_near_ones(nearby: Campaign) -> None:
    assert isinstance(nearby.choice, Nearby)
    far = replace(nearby.choice, near=Near({"sums.py": frozenset()}))
    assert replace(nearby, choice=far).tried(mutant(**LOSES)).verdict == journal.UNSEEN
    named = replace(far, named=["checks/test_sums.py"])
    assert replace(nearby, choice=named).tried(mutant(**LOSES)).verdict == "killed"


@pytest.mark.slow
def test_a_break_that_changes_nothing_survives_all_tests(campaign: Campaign) -> None:
    row = campaign.tried(mutant(**IDLE))
    assert (row.verdict, row.killer, row.tests) == ("survived", "", 2)


@pytest.mark.slow
def test_a_break_that_hangs_is_a_timeout_of_the_test_that_hangs(campaign: Campaign) -> None:
    row = replace(campaign, patience=Patience(least=8.0)).tried(mutant(**HANGS))
    assert (row.verdict, row.killer) == ("timeout", "checks/test_sums.py::test_gauss")
    assert row.seconds >= 8.0


def test_a_break_with_which_tests_cannot_be_collected_in_time_is_a_timeout(
    nearby: Campaign,
) -> None:
    """Computing without end counts; waiting for a processor does not."""
    head = SOURCE.split("\n", maxsplit=1)[0]
    campaign = replace(nearby, patience=Patience(least=2.0))
    row = campaign.tried(mutant(line=1, before=head, after=f"while True: pass\n{head}"))
    assert (row.verdict, row.killer, row.tests) == ("timeout", "", 0)


def test_a_break_that_cannot_be_imported_is_killed(campaign: Campaign) -> None:
    head = SOURCE.split("\n", maxsplit=1)[0]
    row = campaign.tried(mutant(line=1, before=head, after="def all_of(limit):"))
    assert row.verdict == "killed"
    assert row.killer == "collection of checks/test_sums.py"


def test_a_test_that_fails_without_the_break_kills_nothing(campaign: Campaign, tree: Path) -> None:
    (tree / "checks" / "test_sums.py").write_text(CHECKS.replace("== 5050", "== 5051"))
    row = campaign.tried(mutant(**IDLE))
    assert (row.verdict, row.tests) == ("survived", 1)


def test_a_test_that_fails_now_and_then_kills_nothing(campaign: Campaign, tree: Path) -> None:
    """It fails in the first of all runs only, as one that is late on a busy machine."""
    chance = "import pathlib\nif pathlib.Path('ran').exists(): return\npathlib.Path('ran').touch()"
    body = "".join(f"    {line}\n" for line in [*chance.split("\n"), "raise OSError('late')"])
    (tree / "checks" / "test_sums.py").write_text(f"{CHECKS}\ndef test_late():\n{body}")
    late = checks("test_late")[0]
    reach = Reach(tests={late.name: late}, lines={"sums.py": {6: [late.name]}})
    choice = Reaching(tree=tree, work=campaign.work, reach=reach, budget=60.0)
    row = replace(campaign, choice=choice).tried(mutant(**IDLE))
    assert (row.verdict, row.tests) == ("survived", 0)


def test_what_tests_near_it_notice_needs_no_measurement(nearby: Campaign) -> None:
    row = nearby.tried(mutant(**LOSES))
    assert (row.verdict, row.killer, row.tests) == ("killed", "checks/test_sums.py::test_gauss", 1)
    row = nearby.tried(mutant(**IDLE))
    assert (row.verdict, row.killer, row.tests) == ("unseen", "", 2)
    other = mutant(**IDLE)
    assert (
        nearby.tried(
            replace(
                other,
                file="checks/test_sums.py",
                line=6,
                before="def test_nothing():",
                after="def test_none():",
            )
        ).tests
        == 0
    )


def test_slow_tests_and_those_that_fail_anyhow_are_left_out_near_by(
    nearby: Campaign, tree: Path
) -> None:
    more = (
        "import pytest\n@pytest.mark.slow\ndef test_slow(): assert 0\ndef test_wrong(): assert 0\n"
    )
    (tree / "checks" / "test_sums.py").write_text(CHECKS + more)
    (tree / "pytest.ini").write_text((tree / "pytest.ini").read_text() + "markers = slow\n")
    assert nearby.tried(mutant(**IDLE)).verdict == "unseen"


def test_a_file_that_cannot_be_read_without_the_break_kills_nothing(
    nearby: Campaign, tree: Path
) -> None:
    (tree / "checks" / "test_sums.py").write_text("from sums import product\n")
    row = nearby.tried(mutant(**LOSES))
    assert (row.verdict, row.tests) == ("unseen", 0)


@pytest.mark.slow
def test_no_test_begins_when_those_before_have_computed_too_long(
    tree: Path, tmp_path: Path
) -> None:
    work = "import time\nwhile time.process_time() < {}: pass\n"
    for name, seconds in (("a", 0.3), ("b", 0.6)):
        body = work.format(f"begin + {seconds}").replace(
            "while", "begin = time.process_time()\nwhile"
        )
        busy = "".join(f"    {line}\n" for line in body.split("\n"))
        text = f"def test_busy():\n{busy}\ndef test_wrong(): assert 0\n"
        (tree / "checks" / f"test_{name}.py").write_text(text)
    files = ["checks/test_a.py", "checks/test_b.py", "checks/test_sums.py"]
    with broken(tree, mutant(**LOSES)):
        assert run_files(tree, tmp_path, files, Limits(all=9.0, file=0.2)).killer.endswith("gauss")
        assert run_files(tree, tmp_path, files, Limits(all=0.2, file=9.0)).verdict == "survived"
        assert run_files(tree, tmp_path, files, Limits(all=9.0, file=9.0)).killer.endswith("wrong")


def test_the_file_is_as_before_after_a_break(campaign: Campaign, tree: Path) -> None:
    campaign.tried(mutant(**LOSES))
    assert (tree / "sums.py").read_text() == SOURCE
    assert campaign.tried(mutant(**IDLE)).verdict == "survived"  # nor is the compiled form left


def test_a_break_of_other_lines_than_those_that_are_there_is_refused(tree: Path) -> None:
    stale = mutant(line=4, before=LOSES["before"], after="")
    with pytest.raises(StaleMutantError, match=r"sums\.py:4 has changed"), broken(tree, stale):
        pass


def test_tests_run_in_the_order_given(tree: Path, tmp_path: Path) -> None:
    tests = checks("test_nothing", "test_gauss")
    with broken(tree, mutant(**LOSES)):
        outcome = run(tree, tmp_path, tests)
    assert (outcome.killer, outcome.ran) == (tests[1].name, 2)


def attempt_until(stop: int, attempted: list[Mutant]) -> Callable[[Mutant], Row]:
    """Tries by doing nothing, and is interrupted the time after `stop`."""

    def attempt(one: Mutant) -> Row:
        if len(attempted) == stop:
            raise KeyboardInterrupt
        attempted.append(one)
        return replace(Row.of(one), verdict="killed", killer="a\ntest")

    return attempt


def test_an_interrupted_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    path = tmp_path / "journal.csv"
    mutants = [mutant(line=k, before=f"a\\n{k}\n", after=f'"{k}",\n') for k in range(1, 6)]
    attempted: list[Mutant] = []
    said: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        run_all(attempt_until(2, attempted), mutants, path, said.append)
    assert [row.mutant for row in journal.read(path)] == mutants[:2]
    rows = run_all(attempt_until(9, attempted), mutants, path, said.append)
    assert attempted == mutants  # each once
    assert [row.mutant for row in rows] == mutants
    assert "3 left" in said[1]
    assert "0 left" in said[-1]


def test_no_break_is_begun_when_the_time_is_over(tmp_path: Path) -> None:
    attempted: list[Mutant] = []
    mutants = [mutant(line=k, before=f"{k}", after="") for k in range(3)]
    rows = run_all(
        attempt_until(9, attempted), mutants, tmp_path / "j.csv", lambda _: None, seconds=0.0
    )
    assert (rows, attempted) == ([], [])


def test_a_row_that_was_cut_is_tried_again_and_harms_no_other(tmp_path: Path) -> None:
    path = tmp_path / "journal.csv"
    mutants = [mutant(line=k, before=f"a\n{k}", after=f'"{k}",\n') for k in range(1, 4)]
    run_all(attempt_until(9, []), mutants[:2], path, lambda _: None)
    path.write_bytes(path.read_bytes()[:-15])
    attempted: list[Mutant] = []
    run_all(attempt_until(9, attempted), mutants, path, lambda _: None)
    assert attempted == mutants[1:]
    assert [row.mutant for row in journal.read(path)] == mutants


def test_where_a_break_was_tried_again_the_last_row_counts(tmp_path: Path) -> None:
    path = tmp_path / "journal.csv"
    one = mutant(**IDLE)
    for verdict in ("survived", "killed"):
        journal.add(path, replace(Row.of(one), verdict=verdict))
    assert [row.verdict for row in journal.read(path)] == ["killed"]
    assert [row.verdict for row in journal.read_all(path)] == ["survived", "killed"]


@pytest.mark.slow
def test_named_files_try_what_was_left_of_the_named_sources_and_nothing_else(
    tree: Path, tmp_path: Path
) -> None:
    """One is left in the sources asked for, one was noticed, one is of another file."""
    path, work = tmp_path / "journal.csv", tmp_path / "work"
    work.mkdir()
    left, noticed, new = mutant(**LOSES), mutant(**IDLE), mutant(**HANGS)
    elsewhere = replace(left, file="other.py")
    shutil.copy(tree / "sums.py", tree / "other.py")
    for each, verdict in ((left, journal.UNSEEN), (noticed, "killed"), (elsewhere, "survived")):
        journal.add(path, replace(Row.of(each), verdict=verdict))
    words = ["--by", "checks/test_sums.py", "--of", "s*.py"]
    _try_all(_options(words), [left, noticed, new, elsewhere], path, tree=tree, work=work)
    rows = {row.mutant: row.verdict for row in journal.read(path)}
    assert rows == {left: "killed", noticed: "killed", elsewhere: "survived"}
    assert len(journal.read_all(path)) == 4  # one was tried
