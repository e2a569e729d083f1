"""What SUMO warns of is in the log of the run, and nowhere else."""

import logging
from pathlib import Path
from typing import Literal

import pytest

from adapters.sumo import warning_log
from adapters.sumo.errors import SumoError
from adapters.sumo.warning_log import WarningLog
from tests.adapters.red_light import red_light
from tests.adapters.sumo_runs import nobody_drives, scene, simulate, steps

UNSORTED = """
    <route id="way" edges="east_1 east_2"/>
    <vehicle id="b" type="car" route="way" depart="5"/>
    <vehicle id="a" type="car" route="way" depart="2"/>
    <vehicle id="c" type="car" route="way" depart="1"/>
"""
IGNORED = "SUMO (scene.sumocfg): Route file should be sorted by departure time, ignoring "


def said(caplog: pytest.LogCaptureFixture) -> list[tuple[int, str]]:
    """Level and text of what is said of SUMO's warnings."""
    return [
        (record.levelno, record.getMessage())
        for record in caplog.records
        if record.name == warning_log.__name__
    ]


@pytest.fixture(autouse=True)
def log_of_a_run(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


@pytest.mark.parametrize("program", ["libsumo", "sumo"])
@pytest.mark.parametrize("run", ["first", "second"])
def test_demand_that_sumo_drops_is_said(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
    program: Literal["libsumo", "sumo"],
    run: str,
) -> None:
    """In every run of a process alike."""
    del run
    if program == "sumo":
        pytest.importorskip("sumo", reason="the package eclipse-sumo, with SUMO's programs")
    simulate(scene(tmp_path, demand=UNSORTED), 6.0, program=program)
    assert said(caplog) == [
        (logging.WARNING, f"{IGNORED}'a'!"),
        (logging.INFO, f"{IGNORED}'c'!"),
        (logging.WARNING, f"SUMO (scene.sumocfg): 2 in all like: {IGNORED.partition(': ')[2]}'a'!"),
    ]
    printed = capfd.readouterr()
    assert "sorted" not in printed.out + printed.err


def test_the_red_light_has_none(caplog: pytest.LogCaptureFixture) -> None:
    for _ in steps(red_light(), 10.0, nobody_drives, 1, 50_000_000):
        pass
    assert said(caplog) == []


def test_a_name_that_sumo_lengthens_is_found(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    options = '<output-prefix value="TIME_"/>'
    simulate(scene(tmp_path, demand=UNSORTED, options=options), 6.0)
    assert len(said(caplog)) == 3


@pytest.mark.parametrize(
    ("options", "choice"),
    [
        ('<error-log value="own.log"/>', "`error-log`, own.log"),
        ('<no-warnings value="on"/>', "`no-warnings`"),
        ('<output-prefix value="out/"/>', "an `output-prefix` with a folder"),
    ],
)
def test_what_a_scene_wants_stays_so_and_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, options: str, choice: str
) -> None:
    simulate(scene(tmp_path, demand=UNSORTED, options=options), 6.0)
    what = f"SUMO's warnings are not in this log: scene.sumocfg has {choice}"
    assert said(caplog) == [(logging.INFO, what)]
    assert (tmp_path / "own.log").is_file() == ("error-log" in options)


def test_the_other_logs_of_a_scene_are_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    options = '<log value="all.log"/><message-log value="messages.log"/>'
    simulate(scene(tmp_path, demand=UNSORTED, options=options), 6.0)
    for log in ("all.log", "messages.log"):
        assert "street.net.xml' ... done" in (tmp_path / log).read_text()
    assert len(said(caplog)) == 3


def test_nothing_is_left_behind_not_even_by_a_scene_that_sumo_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    simulate(scene(tmp_path, demand=UNSORTED), 6.0)
    with pytest.raises(SumoError, match="SUMO cannot load"):
        simulate(scene(tmp_path, demand="<vehicle id='a' depart='0'/>"), 1.0)
    assert list(folder.iterdir()) == []


def test_of_many_alike_the_first_are_logged_and_all_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Whatever names and numbers are in them, and wherever SUMO's blocks end."""
    warnings = WarningLog(scene(tmp_path))
    file = Path(warnings.options[1])
    alike = [f"Vehicle 'v.{k}' brakes with {k / 7}; time={k}.00." for k in range(50_000)]
    text = "".join(f"Warning: {line}\n" for line in [*alike, "another"])
    for k in range(0, len(text), 8191):
        with file.open("a") as stream:
            stream.write(text[k : k + 8191])
        warnings.read()
    warnings.close()
    warnings.close()
    braking, last = said(caplog)[:-2], said(caplog)[-2:]
    assert [text for _, text in braking] == [f"SUMO (scene.sumocfg): {line}" for line in alike[:20]]
    assert [level for level, _ in braking] == [logging.WARNING] + 19 * [logging.INFO]
    assert last == [
        (logging.WARNING, "SUMO (scene.sumocfg): another"),
        (logging.WARNING, f"SUMO (scene.sumocfg): 50000 in all like: {alike[0]}"),
    ]


def test_kinds_without_end_are_one_kind(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    warnings = WarningLog(scene(tmp_path))
    words = [f"{chr(97 + k % 26)}{chr(97 + k // 26)}" for k in range(600)]
    Path(warnings.options[1]).write_text("".join(f"Warning: {word}\n" for word in words))
    warnings.close()
    assert len(said(caplog)) == 40 + 20 + 1
    assert said(caplog)[-1][1] == f"SUMO (scene.sumocfg): 560 in all like: {words[40]}"
