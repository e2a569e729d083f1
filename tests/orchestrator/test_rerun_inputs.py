"""Where `nlosim rerun` finds what a run read."""

from pathlib import Path

import pytest

from orchestrator.rerunning import inputs
from orchestrator.rerunning.inputs import found_inputs, other_files


def test_a_folder_is_found_where_it_was_relative_to_the_scenario(tmp_path: Path) -> None:
    for name in ("a/nets", "b/nets"):
        (tmp_path / name).mkdir(parents=True)
    entry = {"reader": "one", "at": ["x"], "from": "scenario", "path": "b/nets", "sha256": None}
    found = found_inputs({"paths": [entry]}, tmp_path)
    assert (dict(found.texts), found.missing) == ({("x",): str(tmp_path / "b" / "nets")}, [])
    entry["path"] = "c/none"
    assert found_inputs({"paths": [entry]}, tmp_path).missing == [
        "`c/none`, which `one` reads, is missing"
    ]


def test_files_are_compared_by_content_wherever_they_are() -> None:
    then = {"one": {"a/x.net": "1", "a/y.cfg": "2"}, "two": {"z": "3"}}
    assert other_files(then, {"one": {"b/x.net": "1", "y": "2"}, "two": {"z": "3"}}) == ([], [])
    missing, changed = other_files(then, {"one": {"b/x.net": "9", "b/new": "4"}, "two": {"z": "3"}})
    assert missing == ["`a/y.cfg`, which `one` reads, is missing"]
    assert changed == [
        "`a/x.net`, which `one` reads, has another content",
        "`b/new`, which `one` reads, was not read then",
    ]


def test_no_more_than_so_many_files_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in "abc":
        (tmp_path / name).touch()
    assert [each.name for each in inputs._files(tmp_path)] == ["a", "b", "c"]
    monkeypatch.setattr(inputs, "_MOST", 2)
    assert [each.name for each in inputs._files(tmp_path)] == ["a", "b"]
