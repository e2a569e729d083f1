"""What a campaign writes down while it is under way: who began it, and what is finished."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from typing_extensions import override

from orchestrator.campaign.journal import Journal, read_lines, session
from orchestrator.wording import Openly, Privately


class Numbers(Journal[float]):
    """A journal of numbers; `noted` are those that it has in mind."""

    def __init__(self, path: Path, entries: list[float]) -> None:
        self.noted: list[float] = []
        super().__init__(path, entries)

    @override
    def _note(self, entry: float) -> None:
        self.noted.append(entry)

    @override
    def _content(self, entry: float) -> Mapping[str, Any]:
        return {"number": entry}


@pytest.mark.parametrize("wording", [None, Openly()])
def test_a_session_that_is_not_private_says_command_and_host(wording: Openly | None) -> None:
    found = session(f"nlosim experiment {Path.home()}/a.yaml", wording, file="a.yaml")
    assert found["command"] == f"nlosim experiment {Path.home()}/a.yaml"
    assert found["file"] == "a.yaml"
    assert isinstance(found["host"]["name"], str)
    assert found["host"]["name"]


def test_a_private_session_says_neither_where_it_was_nor_on_what_host(tmp_path: Path) -> None:
    found = session(f"nlosim experiment {tmp_path}/a.yaml", Privately(tmp_path))
    assert found["command"] == "nlosim experiment a.yaml"
    assert found["host"]["name"] is None
    assert found["host"]["cpu"] == session("", None)["host"]["cpu"]


def test_what_is_finished_is_on_the_disk_and_in_mind_at_once(tmp_path: Path) -> None:
    path = tmp_path / "numbers.jsonl"
    journal = Numbers(path, [1.0, 2.0])
    journal.add(3.0)
    assert journal.noted == [1.0, 2.0, 3.0]
    assert read_lines(path).contents == [{"number": n} for n in (1.0, 2.0, 3.0)]  # not closed yet
    journal.close()
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity"])
def test_a_line_that_is_no_json_counts_as_damaged(tmp_path: Path, number: str) -> None:
    """Nobody writes such numbers: JSON has none."""
    with pytest.raises(ValueError, match="not JSON compliant"):
        Numbers(tmp_path / "draft.jsonl", [float(number)])
    path = tmp_path / "numbers.jsonl"
    path.write_text(f'{{"number": 1}}\n{{"number": {number}}}\n{{"number": 3}}\n')
    found = read_lines(path)
    assert found.contents == [{"number": 1}, {"number": 3}]
    assert [each[:25] for each in found.damaged] == ["`numbers.jsonl`, line 2: d"[:25]]


def test_a_line_whose_checksum_is_of_something_else_counts_as_damaged(tmp_path: Path) -> None:
    path = tmp_path / "numbers.jsonl"
    Numbers(path, [1.0, 2.0, 3.0]).close()
    first, second, third = (json.loads(line) for line in path.read_text().splitlines())
    second["crc32"] = first["crc32"]
    path.write_text("".join(f"{json.dumps(line)}\n" for line in (first, second, third)))
    assert read_lines(path).contents == [{"number": 1.0}, {"number": 3.0}]
    assert read_lines(path, ordered=True).contents == [{"number": 1.0}]


def test_the_last_line_counts_if_only_its_end_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "numbers.jsonl"
    Numbers(path, [1.0, 2.0]).close()
    whole = path.read_text()
    path.write_text(whole.removesuffix("\n"))
    assert read_lines(path).contents == [{"number": 1.0}, {"number": 2.0}]
    path.write_text(whole[:-2])
    found = read_lines(path)
    assert (found.contents, found.damaged) == ([{"number": 1.0}], [])
