"""The recording of a whole run: how large it is, and that anybody can read it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orchestrator.recording.recorder
import scenarios
from orchestrator.cli import main
from orchestrator.recording import Recording
from orchestrator.recording.stored import Stored

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
FORMATS = Path(__file__).parents[2] / "docs" / "formats.md"
SECONDS = 3


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some seconds of the red light."""
    out = tmp_path_factory.mktemp("red_light") / "run"
    record(out)
    return out


def record(out: Path) -> None:
    stop = f"time.stop={SECONDS} s"
    arguments = ["run", str(SCENARIO), "--set", stop, "--no-figure", "--quiet", "--json"]
    arguments += ["--set", "measures={}"]
    assert main([*arguments, "--out", str(out)]) == 0


def test_a_second_takes_less_than_a_megabyte_and_loses_nothing(run: Path) -> None:
    """All signals but the points of the lidars. The first seconds have the most receptions."""
    files = {path: path.stat().st_size for path in (run / "signals").rglob("*.zst")}
    assert sum(files.values()) < 1_000_000 * SECONDS
    recording = Recording(run)
    plain = sum(
        sum(len(each) if isinstance(each, bytes) else each.nbytes for each in recording[name])
        for name in recording.signals
    )
    assert plain > 6 * sum(files.values())
    assert recording.fingerprint() == recording.manifest["fingerprint"]
    sizes = recording.manifest["recorded_bytes"]
    times = sum(size for path, size in files.items() if path.name == "time.zst")
    assert sum(sizes.values()) == sum(files.values()) - times
    assert list(sizes.values()) == sorted(sizes.values(), reverse=True)
    assert next(iter(sizes)) == "channel.receptions"


def test_two_runs_have_the_same_bytes(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However often what is recorded is flushed."""
    monkeypatch.setattr(orchestrator.recording.recorder, "FLUSH_INTERVAL", 0.05)
    record(tmp_path / "again")
    for path in (run / "signals").rglob("*"):
        other = tmp_path / "again" / path.relative_to(run)
        assert path.is_dir() or path.read_bytes() == other.read_bytes(), path
    again = (tmp_path / "again" / "signals").rglob("*")
    assert len(list(again)) == len(list((run / "signals").rglob("*")))


def test_the_page_on_formats_reads_every_part(run: Path, tmp_path: Path) -> None:
    """As docs/formats.md shows it, without this package."""
    (block,) = re.findall(r"```python\n(.*?)```", FORMATS.read_text(), re.DOTALL)
    names: dict[str, Any] = {"__name__": "formats"}
    exec(compile(block.replace("print(read_part", "# "), "formats.py", "exec"), names)  # noqa: S102
    filters = set()
    for path in sorted((run / "signals").rglob("*.zst")):
        stored = Stored.open(path)
        found = names["read_part"](path)
        assert found.dtype == stored.dtype
        assert found.shape == (len(stored), *stored.row_shape)
        assert found.tobytes() == stored[0 : len(stored)].tobytes()
        filters |= set(re.findall(rb'"filter":"(\w+)"', path.read_bytes()))
    assert filters == {b"words", b"planes", b"deltas", b"guesses"}
    (tmp_path / "read.py").write_text(block)
    part = run / "signals" / "traffic" / "time.zst"
    done = subprocess.run(
        [sys.executable, "read.py", str(part)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONSAFEPATH": ""},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("[")
    assert np.array_equal(Stored.open(part)[0:3], names["read_part"](part)[:3])


def test_the_manifest_and_the_answer_name_what_takes_most(
    run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    capsys.readouterr()
    without = "recording.exclude=[lidar.points, channel.receptions]"
    arguments = ["run", str(SCENARIO), "--set", "time.stop=500 ms", "--set", without]
    arguments += ["--set", "report=null", "--out", str(tmp_path / "out"), "--quiet"]
    assert main([*arguments, "--no-figure", "--set", "measures={}", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert "channel.receptions" not in answer["recorded_bytes"]
    assert answer["recorded_bytes"] == Recording(tmp_path / "out").manifest["recorded_bytes"]
