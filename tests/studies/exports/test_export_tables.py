"""`nlosim export --csv|--parquet`: what pyarrow and pandas read is what was recorded."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from fmus.messages.records import OUTCOMES, PACKET, RECEPTION, unframe
from orchestrator import table_files
from orchestrator.cli import main
from orchestrator.recording.layout import read_json, write_manifest
from orchestrator.recording.reader import Recording


def exported(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    """What `nlosim export` says as JSON."""
    assert main(["export", *words, "--json"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found


def test_parquet_has_every_road_user_at_every_time_with_units(run: Path) -> None:
    assert main(["export", str(run), "--parquet"]) == 0
    recording = Recording(run)
    path = run / "export" / "parquet" / "road-vehicle.parquet"
    fields = pq.read_schema(path)
    units = {f.name: f.metadata[b"unit"].decode() for f in fields}
    assert units["time"] == "s"
    assert units["vehicle.position[1]"] == "m"
    assert units["vehicle.heading"] == "rad"
    assert units["vehicle.velocity[0]"] == "m/s"
    assert units["vehicle"] == "1"
    frame = pd.read_parquet(path)
    series = recording["road.vehicle.position"]
    ids = recording["road.vehicle.id"]
    assert len(frame) == sum(len(np.asarray(each)) for each in ids)
    for k, (time, here) in enumerate(frame.groupby("time")):
        assert round(float(str(time)) * 1e9) == int(series.times[k])
        assert here["vehicle"].tolist() == np.asarray(ids[k]).tolist()
        place = here[[f"vehicle.position[{n}]" for n in range(3)]].to_numpy()
        assert np.array_equal(place, series[k])


def test_records_are_rows_with_names_and_seconds(run: Path) -> None:
    assert main(["export", str(run), "--parquet", "--signal", "*.receptions"]) == 0
    folder = run / "export" / "parquet"
    assert [path.name for path in folder.iterdir()] == ["air.receptions.parquet"]
    frame = pd.read_parquet(folder / "air.receptions.parquet")
    series = Recording(run)["air.receptions"]
    records = np.concatenate([unframe("RCPT", bytes(each), RECEPTION) for each in series])
    assert len(frame) == len(records) > 100
    assert frame["packet"].tolist() == records["packet"].tolist()
    assert (frame["end"] * 1e9).round().tolist() == records["time"].tolist()
    assert (frame["outcome"] == "received").sum() == (records["outcome"] == 0).sum() > 0
    assert set(frame["kind"]) == {"bsm"}
    metadata = pq.read_schema(folder / "air.receptions.parquet").field("power").metadata
    assert metadata[b"unit"] == b"dBm"


def test_the_names_of_outcomes_are_those_of_their_letters() -> None:
    names = {"R": "received", "N": "noise", "C": "collision", "B": "busy"}
    names |= {"T": "sending", "U": "unnoticed"}
    from studies.exports.records import RECEPTIONS  # noqa: PLC0415 - beside what it is about

    said = RECEPTIONS.columns["outcome"].names
    assert said is not None
    assert {OUTCOMES[k]: name for k, name in said.items()} == names


def test_csv_has_units_in_its_headings_and_goes_back_in(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = exported(capsys, str(run), "--csv", "--out", str(tmp_path / "tables"))
    assert told["out"] == str(tmp_path / "tables")
    packets = pd.read_csv(tmp_path / "tables" / "messages.packets.csv")
    assert {"time [s]", "handed_over [s]", "size [byte]", "source", "kind"} <= set(packets)
    series = Recording(run)["messages.packets"]
    records = np.concatenate([unframe("PKTS", bytes(each), PACKET) for each in series])
    assert (packets["handed_over [s]"] * 1e9).round().tolist() == records["time"].tolist()
    assert packets["size [byte]"].tolist() == records["size"].tolist()
    left_out = told["left_out"]
    assert isinstance(left_out, list)
    assert any(said.startswith("`scanner.points` is left out: binary") for said in left_out)


def test_a_table_of_a_run_drives_the_next_one(run: Path, tmp_path: Path) -> None:
    """The headings are those that `table-source` reads."""
    main(["export", str(run), "--csv", "--signal", "messages.received.sensor_data.count"])
    (run / "next.yaml").write_text(
        "schema: 1\ntitle: Next\ntime: {stop: 1 s}\ncomponents:\n  again:\n    type: table-source\n"
        "    step: 100 ms\n    parameters: {file: export/csv/messages.csv}\nconnections: []\n"
    )
    assert (
        main(
            [
                "run",
                str(run / "next.yaml"),
                "--no-figure",
                "--out",
                str(tmp_path / "next"),
                "--quiet",
            ]
        )
        == 0
    )
    assert "again.received.sensor_data.count" in Recording(tmp_path / "next")


def test_nothing_is_replaced_unasked(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", str(run), "--csv", "--signal", "messages.packets"]
    assert main(words) == 0
    path = run / "export" / "csv" / "messages.packets.csv"
    before = path.read_bytes()
    path.write_text("mine")
    capsys.readouterr()
    assert main(words) == 2
    assert f"`{path.parent}` exists already; --force replaces it" in capsys.readouterr().err
    assert path.read_text() == "mine"
    (path.parent / "notes.txt").write_text("mine, too")
    assert main([*words, "--force"]) == 0
    assert path.read_bytes() == before
    assert (path.parent / "notes.txt").read_text() == "mine, too"
    assert not list(path.parent.parent.glob("*.draft"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--csv", "--signal", "road.vehicle.positon"], "did you mean `road.vehicle.position`?"),
        (["--csv", "--signal", "scanner.points"], "`scanner.points` is left out: binary"),
        (["--fcd", "--signal", "road.*"], "--signal chooses among tables; --fcd has none"),
        (["--csv", "--geo"], "--geo is about --fcd"),
        (["--csv", "--fcd"], "not allowed with argument --csv"),
        ([], "one of the arguments --csv --parquet"),
    ],
)
def test_what_cannot_be_exported_is_said(
    words: list[str], message: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(run), *words]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert not captured.out
    assert not (run / "export" / "csv").exists()
    assert not list(run.rglob("*.draft"))


def test_what_is_no_run_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(tmp_path / "nowhere"), "--csv"]) == 2
    assert f"there is no directory `{tmp_path / 'nowhere'}`" in capsys.readouterr().err
    assert main(["export", str(tmp_path), "--csv"]) == 2
    assert "holds no recording: no `signals/index.json`" in capsys.readouterr().err
    (tmp_path / "experiment.json").write_text("{}")
    assert main(["export", str(tmp_path), "--csv"]) == 2
    assert "is an experiment, not a run" in capsys.readouterr().err


def test_parquet_without_pyarrow_says_what_to_install(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(table_files, "has_parquet", lambda: False)
    monkeypatch.setattr("studies.exports.tables.has_parquet", lambda: False)
    assert main(["export", str(run), "--parquet"]) == 2
    assert "pip install 'nlosim[parquet]'" in capsys.readouterr().err
    assert not (run / "export").exists()


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ({"status": "interrupted", "reached_ns": 700_000_000}, "the run is interrupted at 0.7 s"),
        ({"status": "failed", "reached_ns": None}, "the run is failed; what it had recorded"),
        ({"status": "running", "reached_ns": None}, "the run goes on; what it has recorded so far"),
    ],
)
def test_of_a_run_that_did_not_end_so_much_is_said(
    status: dict[str, object], said: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_manifest(run, {**read_json(run / "manifest.json"), **status})
    told = exported(capsys, str(run), "--csv")
    assert any(said in note for note in told["notes"])  # type: ignore[attr-defined]


def test_of_a_damaged_recording_the_rest_is_exported(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hurt = run / "signals" / "road" / "vehicle.heading.zst"
    hurt.write_bytes(b"")
    (run / "manifest.json").unlink()
    told = exported(capsys, str(run), "--parquet")
    left_out = told["left_out"]
    assert isinstance(left_out, list)
    (said,) = [each for each in left_out if "damaged" in each]
    assert f"`road.vehicle.heading` is left out: `{hurt}` is damaged at byte 0" in said
    names = pq.read_schema(run / "export" / "parquet" / "road-vehicle.parquet").names
    assert "vehicle.position[0]" in names
    assert "vehicle.heading" not in names
    assert "manifest.json` is missing; what was run is not known" in str(told["notes"])
