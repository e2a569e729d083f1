"""Of a recording that is damaged it is said where, and the rest is used."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.blocks import scan
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording


@pytest.fixture
def recorded(scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """The directory of a run with a report."""
    out = tmp_path / "whole"
    assert main(["run", str(scenario_file), "--out", str(out), "--set", "report=trace"]) == 0
    capsys.readouterr()
    return out


def parts(directory: Path) -> list[Path]:
    """The files of the recorded signals."""
    return sorted((directory / "signals").rglob("*.zst"))


def empty(path: Path) -> None:
    path.write_bytes(b"")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(data)


def garbage(path: Path) -> None:
    path.write_bytes(np.random.default_rng(3).bytes(333))


@pytest.mark.parametrize("damage", [empty, cut, flip, garbage, Path.unlink])
def test_every_file_that_is_damaged_is_named_and_the_rest_is_told(
    damage: Callable[[Path], None],
    recorded: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for number, part in enumerate(parts(recorded)):
        copy = tmp_path / f"{number}"
        shutil.copytree(recorded, copy)
        (copy / "metrics.json").unlink()
        hurt = copy / part.relative_to(recorded)
        damage(hurt)
        assert main(["report", str(copy), "--json"]) == 2
        captured = capsys.readouterr()
        error = json.loads(captured.out)["error"]
        assert error["kind"] == "damage"
        assert any(f"`{hurt}`" in fault for fault in error["faults"])
        assert "internal" not in captured.err
        assert (copy / "metrics.json").is_file()
        assert main(["verify", "run", str(copy)]) == 1
        assert f"`{hurt}`" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is damaged: Expecting value"),
        (b"null", "is damaged: it should be an object of JSON"),
        (b"\xff\xfe{}", "is damaged: 'utf-8' codec can't decode"),
        (b"[" * 100_000, "is damaged: maximum recursion depth"),
        (b'{"car.x": 3}', "is damaged: what it says of `car.x` is no type"),
        (
            b'{"car.x": {"layout": "?", "kind": "", "unit": "", "fixed": false}}',
            "is damaged: `car.x` has a layout that does not exist",
        ),
    ],
)
def test_an_index_that_is_damaged_is_named(
    content: bytes, message: str, recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    index = recorded / "signals" / "index.json"
    index.write_bytes(content)
    for command in (["report"], ["verify", "run"]):
        assert main([*command, str(recorded)]) == 2
        assert f"error: `{index}` {message}" in capsys.readouterr().err


def test_a_manifest_that_is_damaged_or_missing_is_named(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = recorded / "manifest.json"
    manifest.write_text("{")
    assert main(["report", str(recorded)]) == 2
    assert f"error: `{manifest}` is damaged: Expecting property" in capsys.readouterr().err
    manifest.unlink()
    assert main(["report", str(recorded)]) == 2
    assert f"error: `{manifest}` is missing" in capsys.readouterr().err


def test_files_that_are_whole_but_of_another_run_are_found(
    recorded: Path, scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No checksum of a file shows that: the fingerprint does."""
    assert main(["verify", "run", str(recorded), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    expected = json.loads((recorded / "manifest.json").read_text())["fingerprint"]
    assert (said["fingerprint"], said["faults"]) == (expected, [])
    other = tmp_path / "other"
    assert main(["run", str(scenario_file), "--out", str(other), "--seed", "8"]) == 0
    swapped = [
        part
        for part in parts(recorded)
        if part.read_bytes() != (other / part.relative_to(recorded)).read_bytes()
    ]
    shutil.copy(other / swapped[0].relative_to(recorded), swapped[0])
    capsys.readouterr()
    assert main(["verify", "run", str(recorded)]) == 1
    assert "are whole, but not those of its `manifest.json`" in capsys.readouterr().out
    assert main(["report", str(recorded)]) == 2
    assert "are whole, but not those of its `manifest.json`" in capsys.readouterr().err


def test_a_run_that_was_killed_has_no_fingerprint_and_is_no_fault(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recorded / "manifest.json"
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps({**manifest, "status": "running", "fingerprint": None}))
    cut(next(part for part in parts(recorded) if part.name == "time.zst"))
    assert main(["verify", "run", str(recorded)]) == 0
    assert "did not come to its end, so there is no fingerprint" in capsys.readouterr().out


def test_a_sound_file_of_another_signal_is_named(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its checksums are right; its rows are of another shape, or no times."""
    whole = {part: part.read_bytes() for part in parts(recorded)}
    by_size = sorted(whole, key=lambda part: scan(part).dtype.itemsize * len(scan(part).row_shape))
    for victim, source in ((by_size[0], by_size[-1]), (by_size[-1], by_size[0])):
        victim.write_bytes(whole[source])
        for signal in Recording(recorded).signals:
            try:
                Recording(recorded)[signal]
            except RecordingError as error:
                assert f"`{victim}` is damaged: it holds rows of " in str(error)  # noqa: PT017
                break
        else:
            pytest.fail(f"{victim} is taken for what it is not")
        victim.write_bytes(whole[victim])
