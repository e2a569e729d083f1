"""Each committed result of the studies is of one commit that was not changed."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

RESULTS = Path(__file__).parents[2] / "docs" / "results"

OF_SEVERAL = {"constant_per", "load", "policies", "radio", "relay"}
"""Experiments of the first campaign, which went on with later commits; seeds are checked again by
`test_kept_results`."""


def commits(experiment: dict[str, Any]) -> set[str]:
    return {str(session["commit"]) for session in experiment["sessions"]}


@pytest.mark.parametrize(
    "path", sorted(RESULTS.glob("*_provenance.json")), ids=lambda path: path.stem
)
def test_a_result_is_of_one_clean_commit(path: Path) -> None:
    """What is made of several experiments says it of each."""
    said = json.loads(path.read_text(encoding="utf-8"))
    name = path.name.removesuffix("_provenance.json")
    for each in said.get("experiments", [said]):
        found = commits(each)
        if name in {f"collision_{old}" for old in OF_SEVERAL}:
            assert len(found) > 1, "take it off the list"
        else:
            (commit,) = found
            assert re.fullmatch("[0-9a-f]{12}", commit), (
                "outside of a checkout, or of a changed one"
            )
