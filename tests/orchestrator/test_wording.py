"""What `--private` leaves out of text and documents."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.campaign.journal import session
from orchestrator.campaign.work import Work, perform
from orchestrator.experiment.journal import _identity
from orchestrator.experiment.load import load_experiment
from orchestrator.wording import Openly, Privately

pytestmark = pytest.mark.skipif(os.sep != "/", reason="the paths are of POSIX")


@pytest.fixture
def wording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Privately:
    monkeypatch.setenv("HOME", "/home/ada")
    monkeypatch.setattr(sys, "path", ["/opt/py/site-packages", ""])
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return Privately(Path("/data/study"), Path("/data/study/nets/deep"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no `/data/study/nets/deep/a.net.xml` there", "no `nets/deep/a.net.xml` there"),
        ("x=/data/study/a,/data/study/b", "x=a,b"),
        ("/opt/py/site-packages/fmus/a.fmu: 3", "fmus/a.fmu: 3"),
        ("/home/ada/keys/run.pem", "~/keys/run.pem"),
        ("a/data/study/b and 1/data/study/b", "a/data/study/b and 1/data/study/b"),
        ("/data/studies/b", "/data/studies/b"),
    ],
)
def test_folders_are_left_out_of_text(text: str, said: str, wording: Privately) -> None:
    assert wording.text(text) == said


def test_of_other_absolute_paths_a_document_keeps_the_name(wording: Privately) -> None:
    here = f"{Path.cwd()}/t.csv"
    document = {"a": ["/mnt/big/net.xml", "m/s", 3.5, None, True, here], "/x/y.fmu": "C:\\a\\b.fmu"}
    assert wording.plain(document) == {
        "a": ["net.xml", "m/s", 3.5, None, True, "t.csv"],
        "y.fmu": "b.fmu",
    }
    assert Openly().plain(document) == document


def test_files_of_one_name_keep_their_digests(wording: Privately) -> None:
    files = {"/mnt/a/x": "1", "/mnt/b/x": "2", "/mnt/c/x": "3"}
    assert wording.plain(files) == {"x": "1", "x (2)": "2", "x (3)": "3"}


def test_an_experiment_that_is_private_says_nothing_of_the_machine(
    scenario_file: Path, tmp_path: Path
) -> None:
    (tmp_path / "table.csv").write_text("a\n")
    file = tmp_path / "experiment.yaml"
    file.write_text(
        "schema: 1\nscenario: two.yaml\nseeds: 1\nset: {report: trace}\nfactors:\n"
        f"  table: {{one: {{components.car.parameters.trace: {tmp_path}/table.csv}}}}\n"
        "metrics: {distance: distance_m}\n"
    )
    experiment = replace(load_experiment(file), private=True)
    identity = _identity(experiment)
    origin = session(f"nlosim experiment {file}", experiment.wording)
    said = json.dumps([identity.fixed, identity.growing, origin])
    assert str(tmp_path) not in said
    assert (identity.fixed["private"], origin["host"]["name"]) == (True, None)
    assert origin["host"]["cpus"] == os.cpu_count()
    assert str(tmp_path) in json.dumps(_identity(load_experiment(file)).growing)


def test_a_run_of_a_private_experiment_is_private(scenario_file: Path, tmp_path: Path) -> None:
    work = Work(
        scenario=str(scenario_file),
        overrides=(),
        keep=str(tmp_path / "kept"),
        scratch=None,
        private=True,
    )
    result = perform(work)
    assert result.error is None
    manifest = json.loads((tmp_path / "kept" / "manifest.json").read_text())
    assert (manifest["private"], manifest["scenario_file"]) == (True, "two.yaml")
    refused = perform(
        Work(scenario=f"{tmp_path}/no.yaml", overrides=(), keep=None, scratch=None, private=True)
    )
    assert refused.error is not None
    assert str(tmp_path) not in refused.error
