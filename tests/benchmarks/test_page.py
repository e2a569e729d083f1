"""The page of results is made from what `nlosim bench --json` wrote."""

import json
import re
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import pytest

from benchmarks import offers
from benchmarks.page import main, page
from tests.benchmarks.schema import ONE

ROOT = Path(__file__).parents[2]
RESULTS = sorted((ROOT / "docs" / "results").glob("bench-*.json"))


def test_there_is_a_result_of_each_benchmark() -> None:
    names = {path.name for path in RESULTS}
    assert {"bench-channel.json", "bench-lidar.json"} <= names
    assert names <= {f"bench-{name}.json" for name in offers.installed()}


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.name)
def test_committed_results_are_complete(path: Path) -> None:
    found = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.validate(found, ONE)
    assert found["complete"]
    assert found["repetitions"] >= 3


def test_the_page_is_up_to_date() -> None:
    assert (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8") == page(RESULTS)


def test_every_row_is_on_the_page() -> None:
    text = page(RESULTS)
    cases = {row["case"] for path in RESULTS for row in json.loads(path.read_text())["rows"]}
    assert set(re.findall(r"^\| ([^ |][^|]*[^ |]) \|", text, re.MULTILINE)) >= cases


def test_settings_are_part_of_the_command(tmp_path: Path) -> None:
    result = {**json.loads(RESULTS[0].read_text()), "settings": {"network": "mine"}}
    path = tmp_path / "bench.json"
    path.write_text(json.dumps(result))
    assert "`nlosim bench channel --set network=mine --repeat" in page([path])


def test_remarks_follow_the_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = tmp_path / "bench-channel.json"
    result.write_bytes(RESULTS[0].read_bytes())
    result.with_suffix(".md").write_text("What bounds it.\n")
    target = tmp_path / "page.md"
    monkeypatch.setattr("sys.argv", ["page", str(target), str(result)])
    main()
    text = target.read_text()
    assert text.endswith("|\n\nWhat bounds it.\n")
    assert "`nlosim bench channel --repeat" in text
