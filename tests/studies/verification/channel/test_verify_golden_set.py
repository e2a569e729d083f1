"""Malformed golden data are refused, with their place."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studies.verification.channel.golden_files import GoldenError
from studies.verification.channel.verification import read_golden_set

from .golden_sample import RUN, change_cell, change_json, read_text, write_text

Change = Callable[[Path], None]


def problems(folder: Path) -> tuple[str, ...]:
    with pytest.raises(GoldenError) as refused:
        read_golden_set(folder, 10)
    return refused.value.problems


def put(name: str, text: str) -> Change:
    return lambda folder: write_text(folder / name, text)


def cell(name: str, column: str, text: str, row: int = 0) -> Change:
    return lambda folder: change_cell(folder / name, column, lambda _: text, row)


def edit(name: str, change: Callable[[Any], object]) -> Change:
    return lambda folder: change_json(folder / name, change)


def cut(name: str) -> Change:
    """The second half of the file is lost."""

    def change(folder: Path) -> None:
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: len(data) // 2])

    return change


def duplicate_last_line(name: str) -> Change:
    def change(folder: Path) -> None:
        text = read_text(folder / name)
        write_text(folder / name, text + text.splitlines()[-1] + "\n")

    return change


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (put("min_sinr.json", "[{]"), r"min_sinr\.json:1:3: Expecting property name"),
        (put("min_sinr.json", "[]"), r"min_sinr\.json: must not be empty"),
        (put("min_sinr.json", "{}"), r"min_sinr\.json: must be a list, not \{\}"),
        (cut("antenna_gain.json"), r"antenna_gain\.json:1:\d+: "),
        (
            edit("antenna_gain.json", lambda cases: cases[2].pop("own")),
            r"antenna_gain\.json: \[2\]: `own` is missing",
        ),
        (
            edit("antenna_gain.json", lambda cases: cases[1].update(own=[1.0])),
            r"antenna_gain\.json: \[1\]\.own: must be 2 numbers, not 1",
        ),
        (
            edit("antenna_gain.json", lambda cases: cases[0].update(gain_db=float("nan"))),
            r"antenna_gain\.json: \[0\]\.gain_db: must be finite, not nan",
        ),
        (
            edit("building_shadowing.json", lambda s: s[0]["queries"][1].update(status="?")),
            r"building_shadowing\.json: \[0\]\.queries\[1\]\.status: `\?` is not known",
        ),
        (
            edit("building_shadowing.json", lambda s: s[0]["obstacles"][0]["shape"].__delitem__(
                slice(2, None))),
            r"\[0\]\.obstacles\[0\]\.shape: a building has 3 corners at least, not 2",
        ),
        (
            edit("vehicle_shadowing.json", lambda s: s[0]["vehicles"][0].update(width=0)),
            r"vehicle_shadowing\.json: \[0\]\.vehicles\[0\]\.width: must be positive, not 0",
        ),
        (
            edit("knife_edge_profile.json", lambda s: s[0]["profile"].reverse()),
            r"knife_edge_profile\.json: \[0\]\.profile: distances must start at 0 and ascend",
        ),
        (
            edit("knife_edge_profile.json", lambda s: s[0].update(profile=[[0, 9], [5, 4]])),
            r"\[0\]\.profile: the antennas are closer than their heights differ",
        ),
        (
            edit("knife_edge_profile.json", lambda s: s[0]["profile"].__delitem__(slice(1, None))),
            r"\[0\]\.profile: needs two points at least, the antennas",
        ),
        (
            edit("vehicle_shadowing.json", lambda s: s[0]["vehicles"].append(s[0]["vehicles"][0])),
            r"\.antenna_id: -?\d+ is the antenna of vehicle 0",
        ),
        (
            edit("antenna_gain.json", lambda cases: cases[0].update(orientation=[0, 0])),
            r"antenna_gain\.json: \[0\]: the direction has no length",
        ),
        (
            edit("min_sinr.json", lambda s: s[0].update(check_to_us=1)),
            r"min_sinr\.json: \[0\]\.check_to_us: must be the end of `ref`",
        ),
        (
            edit("min_sinr.json", lambda s: s[0]["ref"].update(power_mw="strong")),
            r'min_sinr\.json: \[0\]\.ref\.power_mw: must be a number, not "strong"',
        ),
        (
            cell("pathloss.csv", "loss_db", "many", row=3),
            r"pathloss\.csv:5: loss_db: `many` is wrong: could not convert",
        ),
        (
            cell("pathloss.csv", "loss_db", "inf", row=3),
            r"pathloss\.csv:5: loss_db: `inf` is wrong: must be finite",
        ),
        (cell("pathloss.csv", "model", "hata"), r"pathloss\.csv:2: model: `hata` is not known"),
        (cell("pathloss.csv", "alpha", ""), r"pathloss\.csv:2: alpha: is empty, but `simple`"),
        (
            put("pathloss.csv", "id,model\n0,simple\n"),
            r"pathloss\.csv:1: the column `freq_hz` is missing",
        ),
        (put("nist_error_rate.csv", ""), r"nist_error_rate\.csv:1: the column"),
        (
            cell("nist_error_rate.csv", "mpdu_bits", "801"),
            r"nist_error_rate\.csv:2: mpdu_bits: must be a multiple of 8 above 0",
        ),
        (
            cell("nist_error_rate.csv", "bitrate_bps", "54e6"),
            r"nist_error_rate\.csv:2: bitrate_bps: no rate of 10 MHz",
        ),
        (
            cell("nakagami_stats.csv", "draws", "0"),
            r"nakagami_stats\.csv:2: draws, distance_m and m_param must be positive",
        ),
        (cut(f"{RUN}/rx_events.csv.gz"), r"rx_events\.csv\.gz: cannot be read: "),
        (put(f"{RUN}/vehicles.csv", "veh,length,width,height\n"), r"vehicles\.csv: has no rows"),
        (
            put(f"{RUN}/vehicles.csv", "veh,length,width,height\nv0,4,2\n"),
            r"vehicles\.csv:2: has 3 cells; there must be 4",
        ),
        (
            put(f"{RUN}/vehicles.csv", "veh,length,width,height\nv0,4,2,1.5\n"),
            r"vehicles\.csv: `v\d+` is missing",
        ),
        (lambda folder: (folder / RUN / "tx.csv.gz").unlink(), r"file `tx\.csv\.gz` is missing"),
        (
            cell(f"{RUN}/tx.csv.gz", "tx", "v99", row=2),
            r"tx\.csv\.gz:4: tx: there is no `v99`",
        ),
        (
            cell(f"{RUN}/tx.csv.gz", "t_tx_start", "0.1", row=2),
            r"tx\.csv\.gz:4: t_tx_start: lies before t_queued",
        ),
        (
            duplicate_last_line(f"{RUN}/tx.csv.gz"),
            r"tx\.csv\.gz:90: seq: the vehicle has sent a frame of this number before",
        ),
        (
            cell(f"{RUN}/rx_events.csv.gz", "outcome", "X", row=1),
            r"rx_events\.csv\.gz:3: outcome: there is no `X`",
        ),
        (
            cell(f"{RUN}/positions.csv.gz", "t_veins", "0.15", row=50),
            r"positions\.csv\.gz:\d+: t_veins: is not a multiple of 0\.1 s after the first",
        ),
        (
            duplicate_last_line(f"{RUN}/positions.csv.gz"),
            r"positions\.csv\.gz:\d+: a vehicle is listed twice at this time",
        ),
        (
            edit(f"{RUN}/buildings.json", lambda b: b.update(db_per_cut=8)),
            r"buildings\.json: db_per_cut: is 8, but 9 in run\.json",
        ),
        (
            edit(f"{RUN}/run.json", lambda run: run.update(models=["JakesFading"])),
            r"run\.json: models\[0\]: this run cannot be interpreted: `JakesFading` is not known",
        ),
        (
            edit(f"{RUN}/run.json", lambda run: run.pop("noise_floor_dbm")),
            r"run\.json: `noise_floor_dbm` is missing",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_place(golden: Path, change: Change, problem: str) -> None:
    change(golden)
    found, *_ = problems(golden)
    assert re.search(problem, found), found


def test_antennas_may_be_higher_than_they_are_apart(golden: Path) -> None:
    """What counts is how much their heights differ."""
    change_json(golden / "knife_edge_profile.json", lambda s: s[0].update(profile=[[0, 5], [6, 4]]))
    assert "knife_edge_profile.json" in read_golden_set(golden, 10).checks


def test_the_problems_of_all_files_are_told_at_once(golden: Path) -> None:
    write_text(golden / "min_sinr.json", "no JSON")
    change_cell(golden / "pathloss.csv", "loss_db", lambda _: "x")
    change_json(golden / RUN / "run.json", lambda run: run.pop("models"))
    assert [problem.split(":")[0] for problem in problems(golden)] == [
        "pathloss.csv",
        "min_sinr.json",
        f"{RUN}/run.json",
    ]


def test_other_files_are_skipped_by_name(golden: Path) -> None:
    (golden / "notes.txt").write_text("?")
    (golden / "FORMAT.md").write_text("?")
    (golden / "extra").mkdir()
    (golden / "stack" / "README.md").write_text("?")
    assert read_golden_set(golden, 10).skipped == {
        "FORMAT.md": "describes the files",
        "README.md": "describes the files",
        "extra": "unknown, not compared",
        "notes.txt": "unknown, not compared",
        "stack/README.md": "describes the files",
    }


def test_a_set_may_lack_files(golden: Path) -> None:
    for path in golden.glob("*.*"):
        path.unlink()
    (golden / RUN / "pairs.csv").unlink()
    assert list(read_golden_set(golden, 10).checks) == [RUN]


def test_nothing_to_compare_is_an_error(tmp_path: Path) -> None:
    (found,) = problems(tmp_path)
    assert "holds no golden data; known are: pathloss.csv," in found
    (found,) = problems(tmp_path / "none")
    assert found.endswith("there is no such directory")
