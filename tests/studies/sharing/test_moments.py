"""Moments of real traffic: who chooses whom, with the units that are installed."""

import csv
import json
from pathlib import Path

import pytest

from orchestrator.registry import component_type
from studies.sharing import moments
from studies.sharing.choice import Moment
from studies.sharing.moments import APMM, PLAIN, Choice, choices
from studies.verification.perception.session import UnitsUnderTest


@pytest.mark.slow
def test_the_units_choose_in_the_traffic_of_the_red_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """All matrices are heard; what anybody reveals is part of what is hidden."""
    monkeypatch.setattr(moments, "LOOKS", {"red_light": (6,)})
    units = UnitsUnderTest(component_type("lidar"), component_type("perception"))
    found = list(choices("red_light", 0.1, 1, units))
    assert [one.parameters for one in found] == [APMM.name, PLAIN.name]
    for one in found:
        look = one.moment
        assert look.time == 6.0
        assert look.heard == look.candidates >= 1
        assert moments.DEMAND <= look.most <= look.all <= look.hidden
        assert look.revealed <= look.most
        assert look.mean <= look.most
    first, second = (one.moment for one in found)
    assert (first.hidden, first.most, first.best) == (second.hidden, second.most, second.best)


def test_tables_are_of_the_commit_they_began_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the first seed there are tables in the checkout, which is changed by them."""
    look = Moment(
        time=1.0, candidates=2, heard=2, hidden=90.0, chosen=3, best=3, revealed=80.0, most=80.0,
        most_heard=80.0, all=85.0, nearest=20.0, mean=40.0, hidden_vehicles=1, told=1, told_all=1,
    )  # fmt: skip

    def one(scene: str, share: float, seed: int, units: object) -> list[Choice]:
        del units
        return [Choice(scene=scene, share=share, seed=seed, parameters="apmm", moment=look)]

    commits = iter(["clean", "clean-dirty"])
    monkeypatch.setattr("orchestrator.machine.commit", lambda: next(commits))
    monkeypatch.setattr(moments, "choices", one)
    monkeypatch.setattr("sys.argv", ["moments", str(tmp_path), "--seeds", "2"])
    moments.main()
    origin = json.loads((tmp_path / "moments_provenance.json").read_text())
    assert origin["sessions"][0]["commit"] == "clean"
    assert (origin["seeds"], origin["runs"], origin["planned"]) == ("1..2", 12, 12)
    rows = (tmp_path / "moments_looks.csv").read_text().splitlines()
    assert len(rows) == 1 + 12
    table = (tmp_path / "moments.csv").read_text().splitlines()
    scores = list(csv.DictReader(table))
    assert [(row["scene"], row["share"]) for row in scores] == [
        (scene, str(share)) for scene in moments.LOOKS for share in moments.SHARES
    ]
    assert {row["looks"] for row in scores} == {"2"}
