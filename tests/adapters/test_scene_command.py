"""`nlosim scene new` and `nlosim scene show`: a scene becomes a scenario, and a picture."""

import json
from pathlib import Path

import pytest

from adapters.sumo.draft import draft
from adapters.sumo.files import read_scene
from orchestrator.cli import main
from orchestrator.scenario.build import load_scenario
from tests.adapters.scene import ROUTES, SHAPES, Folder

CAR = '<vehicle id="v" depart="0"><route edges="south_in north_out"/></vehicle>'
SECOND = 10**9


@pytest.fixture
def config(folder: Folder) -> Path:
    folder.write(ROUTES, f"<routes>{CAR}</routes>")
    return folder.config(routes=ROUTES)


@pytest.mark.parametrize(
    ("more", "start", "stop"),
    [
        ("", 0, 60 * SECOND),
        ('<begin value="57600"/><end value="57660"/>', 57_600 * SECOND, 57_660 * SECOND),
        ('<step-length value="0.033"/>', 0, 59_730_000_000),
        ('<step-length value="0.033"/><end value="33"/>', 0, 33 * SECOND),
        ('<step-length value="0.25"/><end value="10.3"/>', 0, 10_250_000_000),
        ('<begin value="100"/><end value="100"/>', 100 * SECOND, 160 * SECOND),
        ('<end value="0.5"/><step-length value="1"/>', 0, 60 * SECOND),
    ],
)
def test_a_draft_runs_whatever_the_times_of_the_scene(
    more: str, start: int, stop: int, folder: Folder, config: Path
) -> None:
    """All steps divide the simulated time, which ends with the scene at the latest."""
    out = folder.path / "town.yaml"
    config = folder.config(routes=ROUTES, more=more)
    assert main(["scene", "new", str(config), "--out", str(out)]) == 0
    scenario = load_scenario(out)
    assert (scenario.start, scenario.stop) == (start, stop)
    assert all((stop - start) % use.step == 0 for use in scenario.components.values())


def test_a_draft_says_what_may_not_be_meant(
    folder: Folder, capsys: pytest.CaptureFixture[str]
) -> None:
    """As `nlosim check` does, and the log of the run."""
    folder.write(
        SHAPES, '<additional><poly id="b" type="building" shape="0,0 9,0 9,9"/></additional>'
    )
    folder.write(ROUTES, f"<routes>{CAR}</routes>")
    config = folder.config(routes=ROUTES, additional=SHAPES)
    out, ran = folder.path / "town.yaml", folder.path / "ran"
    what = "1 of 1 buildings says no height and is taken as 10 m high"
    for words in (
        ["scene", "new", str(config), "--out", str(out)],
        ["check", str(out)],
    ):
        assert main(words) == 0
        assert f"{SHAPES}:1:13: {what} (a remark)\n" in capsys.readouterr().out
    assert main(["run", str(out), "--set", "time.stop=100 ms", "--out", str(ran)]) == 0
    assert f"{SHAPES}:1:13: {what}\n" in (ran / "log.txt").read_text()


def test_a_draft_is_not_written_for_a_scene_that_cannot_run(
    folder: Folder, capsys: pytest.CaptureFixture[str]
) -> None:
    folder.write(ROUTES, '<routes><trip id="a" depart="0" from="x" to="north_out"/></routes>')
    out = folder.path / "town.yaml"
    assert main(["scene", "new", str(folder.config(routes=ROUTES)), "--out", str(out)]) == 2
    assert "`from`: the net has no edge `x`" in capsys.readouterr().err
    assert not out.exists()


def test_a_step_that_no_scenario_can_have_is_replaced_and_said(folder: Folder) -> None:
    files, _ = read_scene(folder.config(more='<step-length value="20"/>'))
    made = draft(files, folder.path)
    assert "step_length: 100 ms" in made.text
    assert made.assumptions[0].startswith("SUMO's step is 100 ms, not the scene's, 20 s")


def test_outputs_are_named_once_and_not_without_end(folder: Folder) -> None:
    loops = "".join(
        f'<e1Detector id="d{k}" lane="south_in_0" pos="{k}" period="9" file="{k % 20}.xml"/>'
        for k in range(60)
    )
    folder.write("loops.add.xml", f"<additional>{loops}</additional>")
    files, _ = read_scene(folder.config(additional="loops.add.xml"))
    said = draft(files, folder.path).assumptions[-1]
    assert said.endswith("`6.xml`, `7.xml` and 12 more")


def show(folder: Folder, config: Path, *options: str) -> int:
    out = folder.path / "town.yaml"
    main(["scene", "new", str(config), "--out", str(out)])
    return main(["scene", "show", str(out), *options])


def test_a_picture_counts_who_is_there(
    folder: Folder, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = str(folder.path / "town.svg")
    assert show(folder, config, "--at", "1s", "--out", picture, "--json") == 0
    printed = capsys.readouterr().out
    assert json.loads(printed[printed.rindex("{") :]) == {"out": picture, "road_users": 1}


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (("--at", "soon"), "`--at`: `soon` is not a number with a unit"),
        (("--at", "30"), "`--at`: `30` has no unit; write `30 s`"),
        (("--out", "town.xyz"), "`--out`: town.xyz is no picture; end its name with .png"),
        (("--out", "nowhere/a.png"), "`--out`: there is no folder nowhere"),
        (("--seed", "-4"), "--seed: expected a whole number from 0 on, got '-4'"),
    ],
)
def test_wrong_options_of_a_picture_end_with_code_2(
    options: tuple[str, ...],
    what: str,
    folder: Folder,
    config: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    assert show(folder, config, *options) == 2
    captured = capfd.readouterr()
    assert what in captured.out + captured.err
