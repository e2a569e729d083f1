"""`nlosim verify perception`."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

from orchestrator import registry
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import ComponentError
from orchestrator.parameters import ComponentType
from studies.verification.perception import verification as module
from studies.verification.perception.command import add_unit
from studies.verification.perception.parameter_set import LADDER, RECOMMENDED, all_sets
from studies.verification.perception.scoring import play
from studies.verification.perception.session import UnitsUnderTest
from studies.verification.perception.summary import zone_areas
from studies.verification.perception.tables import as_text
from studies.verification.perception.verification import Verification, verify
from tests.commands import executed

from .conftest import SCENES, SEED

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def built_units(types: dict[str, ComponentType], monkeypatch: pytest.MonkeyPatch) -> None:
    """The FMUs as the sources make them are those that are installed."""
    monkeypatch.setattr(registry, "component_type", types.__getitem__)


def execute(*words: str) -> Outcome:
    return executed(add_unit, "perception", *words)


@pytest.fixture
def played(verification: Verification, monkeypatch: pytest.MonkeyPatch) -> Verification:
    """The command finds these scenes instead of playing its own."""
    monkeypatch.setattr(module, "verify", lambda *_, **__: verification)
    return verification


def test_tables_and_verdict(played: Verification) -> None:
    outcome = execute("--scenes", str(SCENES))
    assert outcome.exit_code is (Exit.DONE if played.passes else Exit.NOT_PASSED)
    lines = outcome.text.splitlines()
    assert lines[0].startswith(f"{SCENES} scenes, seed {SEED}; ")
    for one in LADDER:
        assert any(line.startswith(one.name) for line in lines)
    assert lines[-3].startswith("with 30 to 50 candidates (1 scenes): right sharer ")
    assert lines[-2].startswith("right sharer: ")
    assert lines[-1].startswith("bytes of always-on sharing: ")
    assert all(line.endswith(("target 95%: met", "target 95%: NOT met", "target 5%: met",
                              "target 5%: NOT met")) for line in lines[-2:])  # fmt: skip


def test_json_has_every_parameter_set(played: Verification) -> None:
    data = json.loads(json.dumps(execute("--json").data, allow_nan=False))
    assert data["sets"].keys() == {one.name for one in all_sets()}
    assert data["pass"] == played.passes
    assert data["scenes"] == SCENES
    assert data["complete"] is True
    best = data["sets"][RECOMMENDED.name]
    assert data["right_sharer"] == best["right"]
    assert data["byte_share"] == best["byte_share"] < best["byte_share_whole"]
    for ways in data["bytes"].values():
        assert list(ways) == ["APMM, demanded", "APMM, whole", "always-on", "CPM"]
    assert sum(one["scenes"] for one in data["by_candidates"].values()) == SCENES + 1
    assert 0.0 < best["precision"] <= 1.0


def test_the_page_shows_its_figures(played: Verification, tmp_path: Path) -> None:
    folder = tmp_path / "some-validation"
    outcome = execute("--figures", str(folder))
    page = tmp_path / "some-validation.md"
    assert outcome.text.endswith(f"wrote {page}")
    text = page.read_text()
    shown = re.findall(r"\]\(some-validation/(.*?)\)", text)
    assert set(shown) == {path.name for path in folder.iterdir()}
    assert {"zones.png", "sharers.png", "bytes.png"} <= set(shown)
    assert f"{SCENES} scenes of seed {SEED}" in text
    assert f"{played.recommended.right:.1%}" in text
    assert "nan" not in text.lower()
    assert not re.search(r"\{[a-z:]", text)


def test_the_same_scenes_make_the_same_bytes(units: UnitsUnderTest) -> None:
    first, second = (play(units, SEED, 1, LADDER).result for _ in range(2))
    assert first == second


def test_the_unit_finds_hidden_road(verification: Verification) -> None:
    """Much better than chance: in these scenes, less than half of the road is hidden."""
    hidden = sum(one.hidden_area for one in verification.results)
    road = sum(one.interest_area for one in verification.results)
    found = zone_areas(verification.results, RECOMMENDED.name)
    assert hidden / road < 0.5
    assert found.precision > hidden / road + 0.2
    assert found.recall > 0.4


def test_sharers_are_candidates(verification: Verification) -> None:
    for one in verification.results:
        for choice in one.choices.values():
            assert set(choice.sharers) <= one.areas.keys()
            assert choice.apm_bytes > 0


def test_what_was_played_before_an_interruption_is_printed(
    monkeypatch: pytest.MonkeyPatch, units: UnitsUnderTest
) -> None:
    first = play(units, SEED, 0, LADDER)
    scenes = iter([first])

    def stop(*_: object) -> object:
        found = next(scenes, None)
        if found is None:
            raise KeyboardInterrupt
        return found

    monkeypatch.setattr(module, "play", stop)
    outcome = execute("--scenes", "9")
    assert outcome.exit_code is Exit.INTERRUPTED
    assert outcome.text.startswith("1 scenes")
    assert outcome.text.endswith("interrupted: these are the scenes played until then")
    assert outcome.data["scenes"] == 1
    assert outcome.data["complete"] is False
    assert outcome.data["error"]["kind"] == "interrupted"


def test_an_interruption_at_once(monkeypatch: pytest.MonkeyPatch, units: UnitsUnderTest) -> None:
    def stop(*_: object) -> object:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "play", stop)
    found = verify(units, seed=1, scenes=4, sets=LADDER)
    assert as_text(found) == "no scene was played"
    json.dumps(found.as_data(), allow_nan=False)


def test_a_unit_that_fails_is_named(types: dict[str, ComponentType]) -> None:
    wrong = UnitsUnderTest(types["lidar"], types["lidar"])
    with pytest.raises(ComponentError, match="perception"):
        verify(wrong, seed=1, scenes=1, sets=LADDER)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--scenes", "0"), "must be a whole number from 1 on, not `0`"),
        (("--scenes", "many"), "must be a whole number from 1 on, not `many`"),
        (("--seed", "-1"), "must be a whole number from 0 on, not `-1`"),
    ],
)
def test_wrong_numbers_are_refused(
    words: tuple[str, str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        execute(*words)
    assert message in capsys.readouterr().err


def test_the_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "shapely" else 1)
    outcome = execute()
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert outcome.text == "error: shapely must be installed: pip install 'nlosim[verify]'"
