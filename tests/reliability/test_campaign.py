"""The campaign finds what is wrong, puts it down to its case, and says how to see it again."""

import json
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.reliability.__main__ import main
from tests.reliability.archive_mutations import WAYS as ARCHIVE_WAYS, archived
from tests.reliability.area import Area, Outcome, of_cases
from tests.reliability.areas import AREAS
from tests.reliability.byte_mutations import mutated_bytes
from tests.reliability.codecs import Codec
from tests.reliability.commands import Said, nlosim
from tests.reliability.isolation import Bounds, isolated
from tests.reliability.messages import Perform, performer
from tests.reliability.page import written
from tests.reliability.scenarios import drawn
from tests.reliability.signals import hears
from tests.reliability.tally import read_table
from tests.reliability.yaml_mutations import WAYS, mutated

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="copies of a process, and /proc")


class Toy:
    """Cases of which some are not as they should be, until they are repaired.

    Args:
        bad: their numbers.
        cut: Ctrl-C comes before this one.
    """

    def __init__(self, bad: set[int], cut: int = -1) -> None:
        self.bad, self.cut = bad, cut
        self.performed: list[int] = []

    def some(self, seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
        for number in numbers:
            if number == self.cut:
                raise KeyboardInterrupt
            self.performed.append(number)
            why = f"wrong with seed {seed}" if number in self.bad else ""
            yield Outcome(number, f"kind {number % 2}", not why, why, seconds=number / 10)

    @property
    def area(self) -> Area:
        return of_cases("toy", "toys", full=10, small=4, some=self.some)


def run(toy: Toy, folder: Path, *arguments: str) -> tuple[int, list[dict[str, str]]]:
    out = folder / "table.csv"
    code = main([*arguments, "--out", str(out)], [toy.area], folder / "state")
    return code, read_table(out)


def test_a_failure_is_reported_with_the_line_that_shows_it_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, rows = run(Toy({3}), tmp_path, "toy", "--cases", "full", "--seed", "5")
    assert code == 1
    again = "python -m tests.reliability toy --seed 5 --only 3"
    assert [(row["kind"], row["cases"], row["as_it_should_be"]) for row in rows] == [
        ("kind 0", "5", "5"),
        ("kind 1", "5", "4"),
    ]
    assert [row["failures"] for row in rows] == ["", f"{again}: wrong with seed 5"]
    assert rows[1]["seconds_longest"] == "0.90"
    said = capsys.readouterr()
    assert again in said.out
    assert "9 of 10 cases were as they should be" in said.out
    toy = Toy({3})
    assert main(["toy", "--seed", "5", "--only", "3"], [toy.area], tmp_path) == 1
    assert toy.performed == [3]
    assert "toy, case 3, kind 1: wrong with seed 5 (0.30 s" in capsys.readouterr().out


def test_it_goes_on_where_it_was_cut_off_and_tries_again_what_failed(tmp_path: Path) -> None:
    code, rows = run(Toy({1}, cut=4), tmp_path)
    assert (code, sum(int(row["cases"]) for row in rows)) == (4, 4)
    toy = Toy(set())
    code, rows = run(toy, tmp_path)
    assert toy.performed == [1, 4, 5, 6, 7, 8, 9]
    assert code == 0
    assert [(row["cases"], row["as_it_should_be"], row["failures"]) for row in rows] == [
        ("5", "5", ""),
        ("5", "5", ""),
    ]


def test_it_goes_on_from_its_table_where_nothing_else_is_left(tmp_path: Path) -> None:
    """As in a new checkout, which has the table and not the folder `runs`."""
    run(Toy({1, 3}, cut=4), tmp_path)
    shutil.rmtree(tmp_path / "state")
    toy = Toy({3})
    code, rows = run(toy, tmp_path)
    assert toy.performed == [1, 3, 4, 5, 6, 7, 8, 9]
    assert code == 1
    assert [(row["cases"], row["as_it_should_be"]) for row in rows] == [("5", "5"), ("5", "4")]
    assert (
        rows[1]["failures"]
        == "python -m tests.reliability toy --seed 1 --only 3: wrong with seed 1"
    )
    shutil.rmtree(tmp_path / "state")
    toy = Toy(set())
    run(toy, tmp_path, "--seed", "2")  # the table is of another seed
    assert toy.performed == [*range(10)]


def test_it_begins_anew_if_it_is_told_to(tmp_path: Path) -> None:
    run(Toy({1}), tmp_path)
    toy = Toy(set())
    code, rows = run(toy, tmp_path, "--anew")
    assert toy.performed == [*range(10)]
    assert (code, [row["as_it_should_be"] for row in rows]) == (0, ["5", "5"])


def test_a_small_campaign_is_performed_each_time(tmp_path: Path) -> None:
    run(Toy(set()), tmp_path)
    for _ in range(2):
        toy = Toy(set())
        run(toy, tmp_path, "--cases", "small")
        assert toy.performed == [0, 1, 2, 3]


def test_an_area_whose_cases_come_in_their_order_only_can_be_asked_for_one() -> None:
    area = replace(Toy({3}).area, some=None)
    assert [outcome.case for outcome in area.outcomes(1, [2, 3])] == [2, 3]
    assert [outcome.is_expected for outcome in area.outcomes(1, [2, 3])] == [True, False]


def test_other_areas_keep_their_rows(tmp_path: Path) -> None:
    first, second = Toy(set()).area, replace(Toy({1}).area, name="other")
    for area in (first, second):
        main([area.name, "--out", str(tmp_path / "t.csv")], [first, second], tmp_path)
    assert [row["area"] for row in read_table(tmp_path / "t.csv")] == [
        "toy",
        "toy",
        "other",
        "other",
    ]


@pytest.mark.slow
@on_linux
@pytest.mark.parametrize("together", [1, 4])
def test_crashes_hangs_and_memory_are_put_down_to_their_cases(together: int) -> None:
    bounds = Bounds(seconds=3, megabytes=300, together=together)
    found = list(isolated("tests.reliability.odd_cases:performer", 1, range(10), bounds))
    assert [outcome.case for outcome in found] == list(range(10))
    wrong = {outcome.case: (outcome.kind, outcome.why) for outcome in found if outcome.why}
    assert wrong == {
        2: ("kind 2", "the process ended with SIGSEGV"),
        4: ("kind 4", "not over after 3 s"),
        6: ("kind 6", "the process ended with 7"),
        8: ("memory", "MemoryError"),
    }
    assert not any(outcome.is_expected for outcome in found if outcome.why)


@on_linux
@pytest.mark.parametrize("is_ours", [False, True])
def test_a_signal_counts_from_when_the_command_hears_it(*, is_ours: bool) -> None:
    """Not from a time after its start, which on a busy machine is before it has begun."""
    ours = "from orchestrator.cli.requests import *; heard_at_once(is_json=False); "
    code = f"{ours if is_ours else ''}print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert hears(process.pid) is is_ours
        process.communicate(b"\n")


def codec(**changes: object) -> Codec:
    plain = Codec(
        name="plain",
        valid=lambda rng: b"7",
        decode=int,
        encode=lambda value: str(value).encode(),
        errors=(ValueError,),
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def test_a_codec_that_raises_what_it_does_not_declare_is_found(tmp_path: Path) -> None:
    assert codec().fault(b"7") == codec().fault(b"x") == ""
    broken = codec(decode=lambda message: {}[message])
    assert broken.fault(b"7") == "decoding raises KeyError(b'7')"
    perform = Perform(1, [codec(), broken])
    assert perform(4).is_expected
    assert perform(5).why.startswith("decoding raises KeyError")
    assert perform(5) == Perform(1, [codec(), broken])(5)


def test_a_codec_that_says_something_else_when_it_encodes_again_is_found() -> None:
    assert codec(encode=lambda value: b"8").fault(b"7") == "encoded again it is another value"
    assert "cannot be encoded" in codec(encode=lambda value: b"x").fault(b"7")
    assert codec(decode=float, encode=lambda value: b"nan").fault(b"nan") == ""


def test_what_is_documented_of_a_command() -> None:
    assert nlosim(["--version"]).fault((0,)) == ""
    missing = nlosim(["check", "/nowhere.yaml"])
    assert (missing.code, missing.fault()) == (2, "")
    assert missing.fault((0,)).startswith("exit code 2: /nowhere.yaml:1:1: cannot be read")
    assert Said(2, "what?").fault().startswith("exit code 2 without a message in the docu")
    assert Said(0, "Traceback (most recent call last)\nE").fault().startswith("a traceback: ")
    assert Said(5, "internal error: E").fault() == "exit code 5: internal error: E"


def test_cases_follow_from_seed_and_number() -> None:
    text = b"a: {b: 1 s, c: [1, 2.5, x]}\nd: text\n"
    for way in WAYS:
        one, two = (mutated(text, way, random.Random(n)) for n in (3, 3))  # noqa: S311
        assert one == two, way
    assert len({mutated(text, "bytes", random.Random(n)) for n in range(50)}) > 40  # noqa: S311
    assert len({mutated_bytes(text, random.Random(n)) for n in range(50)}) > 40  # noqa: S311
    entries = [
        ("modelDescription.xml", b'<fmiModelDescription a="1"><b c="2"/></fmiModelDescription>')
    ]
    for name, change in ARCHIVE_WAYS.items():
        one, two = (change(entries, random.Random(n)) for n in (5, 5))  # noqa: S311
        assert one == two, name
    assert archived(entries)[:2] == b"PK"
    kinds = [drawn(1, number).kind for number in range(90)]
    assert kinds == [drawn(1, number).kind for number in range(90)]
    assert {kind.partition(":")[0] for kind in kinds} == {"scenario", "experiment", "training"}


def test_each_codec_reads_what_it_wrote(tmp_path: Path) -> None:
    """Nothing is declared as an error that a sound message meets."""
    for each in performer(1, tmp_path).codecs:
        for number in range(3):
            message = performer_valid(each, number)
            value = each.decode(message)
            if each.encode is not None:
                assert each.fault(message) == "", each.name
                assert value is not None or each.name == "packed values", each.name


def performer_valid(each: Codec, number: int) -> bytes:
    return each.valid(random.Random(f"{each.name} {number}"))  # noqa: S311


def test_the_page_counts_and_says_what_is_a_part() -> None:
    row = {"area": "scenarios", "kind": "a", "cases": "3", "as_it_should_be": "2", "seed": "1"}
    row |= {"seconds_longest": "1.5", "peak_mb": "20", "full_size_of_area": "10000"}
    page = written([{**row, "failures": "python -m x: wrong"}], [], [])
    assert "| scenarios | 3 of 10,000 | 2 | 1.5 | 20 |" in page
    assert "| scenarios | a | 3 | 2 |" in page
    assert "`python -m x`: wrong" in page


@on_linux
@pytest.mark.slow
@pytest.mark.parametrize("area", AREAS, ids=lambda area: area.name)
def test_a_part_of_every_area_is_as_it_should_be(area: Area) -> None:
    """The same cases as `make verify-reliability CASES=small`."""
    if area.needs:
        pytest.skip(area.needs)
    wrong = [each for each in area.outcomes(1, range(area.small)) if not each.is_expected]
    assert wrong == []


@pytest.mark.parametrize(("change", "said"), [("[0]", ""), ("[1]", "another value")])
def test_values_that_are_nested_as_deep_as_they_can_be_read_are_compared(
    change: str, said: str
) -> None:
    """What is read is never the fault of how it is compared; and the limit is as it was."""
    deep, limit = 600, sys.getrecursionlimit()

    def encode(value: Any) -> bytes:
        return json.dumps(value).replace("[0]", change).encode()

    codec = Codec(name="deep", valid=lambda rng: b"", decode=json.loads, encode=encode)
    fault = codec.fault(("[" * deep + "0" + "]" * deep).encode())
    assert fault.endswith(said)
    assert bool(fault) == bool(said)
    assert sys.getrecursionlimit() == limit
