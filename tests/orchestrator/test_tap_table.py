"""`nlosim tap`: what it makes of messages, on a terminal, at the end, as JSON and from a file."""

import io
import json
import math
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.cli import main, tap as command
from orchestrator.signal import Causality, Connector
from orchestrator.tap.place import FILE
from orchestrator.tap.stream import (
    PUBLICATIONS,
    PUBLISHED,
    Kind,
    Message,
    Reader,
    Schema,
    Writer,
    append,
    messages,
)
from orchestrator.tap.table import Table, sparkline

S = 1_000_000_000
OUTPUT = Causality.OUTPUT
OUTPUTS = {
    "fast.x": Connector(causality=OUTPUT, unit="m/s"),
    "fast.points": Connector(causality=OUTPUT, shape=("n", 2), unit="m"),
    "slow.text": Connector(causality=OUTPUT, dtype=None, mime_type="text/plain"),
    "slow.raw": Connector(causality=OUTPUT, dtype=None),
    "slow.flag": Connector(causality=OUTPUT, dtype=np.bool_),
    "slow.empty": Connector(causality=OUTPUT, shape=("n",)),
    "slow.late": Connector(causality=OUTPUT),
}


def stream(
    seconds: int = 4, end: dict[str, Any] | None = None, largest: int | None = None
) -> bytes:
    """A recorded run of two components: one publishes 100 times a second, one every two seconds."""
    schema = Schema.of("example", (0, 10 * S), ["fast", "slow"], OUTPUTS, largest)
    writer, file = Writer(schema), io.BytesIO()
    append(file, writer.schema())
    for t in range(seconds + 1):
        values: dict[str, Any] = {
            PUBLISHED: np.array([t * S, t // 2 * 2 * S]),
            PUBLICATIONS: np.array([100 * t + 1, t // 2 + 1]),
            "fast.x": np.array(t**2 / 3),
            "fast.points": np.array([[-1.5, t], [0.25, 7.0]]),
            "slow.text": f"{t // 2} of text".encode(),
            "slow.raw": bytes(t),
            "slow.flag": np.array(t > 2),
            "slow.empty": np.empty(0),
        }
        append(
            file,
            writer.encode(Message(kind=Kind.VALUES, t=t * S, points=100 * t, wall=2 * t * S,
                                  left_out=t // 3, values=values)),
        )  # fmt: skip
    if end is not None:
        append(file, writer.encode(Message(kind=Kind.END, t=seconds * S, points=400, document=end)))
    return file.getvalue()


def table_of(content: bytes, asked: Sequence[str] = ()) -> Table:
    table, reader = Table(asked), Reader()
    for raw in messages(io.BytesIO(content)):
        table.take(reader.decode(raw), reader.schema)
    return table


def test_rates_and_ages_are_of_simulated_time() -> None:
    table = table_of(stream(5))
    assert table.rate("fast.x") == pytest.approx(100)
    assert table.rate("slow.flag") == pytest.approx(2 / 5)  # in five seconds it published twice
    assert [table.age("fast.x"), table.age("slow.flag")] == [0.0, 1.0]
    assert table.speed == pytest.approx(0.5)
    assert table.left_out == 3
    assert (table.time, table.points, table.status) == (5 * S, 500, "running")


def test_rates_are_those_of_late() -> None:
    """Of the last twenty messages: what was before is forgotten."""
    table = table_of(stream(40))
    assert table.rate("fast.x") == pytest.approx(100)
    assert len(table.rows["fast.x"].course) == 24
    assert table.rows["fast.x"].course[-1] == pytest.approx(1600 / 3)


def test_the_table_as_text() -> None:
    lines = table_of(stream(4, {"status": "done", "ended_early": "`slow` asked"})).lines(200, 50)
    head, *rows, last = lines
    assert head == "t = 4.000 of 10 s, 0.5 simulated seconds per second, 2 messages left out"
    cells = {row.split()[0]: row for row in rows}
    assert list(cells) == list(OUTPUTS)
    assert cells["fast.x"].split()[1:5] == ["100", "Hz", "0", "ms"]
    assert cells["fast.x"].endswith("▁▁▃▅█                     5.33333 m/s")
    assert cells["fast.points"].endswith("-1.5 to 7 m (2x2)")
    assert cells["slow.text"].endswith("'2 of text'")
    assert cells["slow.raw"].endswith("  4 bytes")
    assert cells["slow.flag"].split()[1:5] == ["0.5", "Hz", "0", "ms"]
    assert cells["slow.flag"].endswith("▁▁▁██                     True")
    assert cells["slow.empty"].endswith("  (0)")
    assert cells["slow.late"].endswith("nothing yet")
    assert last == "done: `slow` asked"
    assert len({line.index(" Hz") for line in rows}) == 1


def test_without_the_signals_of_the_tap_itself_ages_are_unknown() -> None:
    schema = Schema.of("example", (0, S), ["fast", "slow"], OUTPUTS)
    writer, reader, table = Writer(schema), Reader(), Table()
    for raw in (
        writer.schema(),
        writer.encode(Message(kind=Kind.VALUES, values={"fast.x": np.array(1.0)})),
    ):
        table.take(reader.decode(raw), reader.schema)
    assert math.isnan(table.age("fast.x"))
    assert table.data()["signals"]["fast.x"]["age_s"] is None
    assert table.rows["fast.x"].course == deque([1.0])


def test_what_has_no_room_is_counted() -> None:
    lines = table_of(stream()).lines(40, 5)
    assert len(lines) == 4
    assert lines[-1] == "and 5 more; name some, or patterns of th"
    assert all(len(line) <= 40 for line in lines)


def test_large_values_are_said_to_be_large() -> None:
    (late,) = (x for x in table_of(stream(largest=65536)).lines(200, 50) if "slow.late" in x)
    assert late.endswith("more than 65.5 kB: name it to see it")


@pytest.mark.parametrize(
    ("course", "bars"),
    [
        ([], ""),
        ([1.0], "▁"),
        ([2.0, 2.0], "▁▁"),
        ([0, 1, 2, 3, 4, 5, 6, 7], "▁▂▃▄▅▆▇█"),
        ([-1e300, math.nan, 1e300, math.inf], "▁ █ "),
    ],
)
def test_courses_are_drawn_between_their_extremes(course: list[float], bars: str) -> None:
    assert sparkline(deque(course)) == bars


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "example.tap"
    path.write_bytes(stream(4, {"status": "failed", "error": "component `fast`: no"}))
    return path


def test_a_recorded_stream_is_shown(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tap", str(file)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "failed: component `fast`: no"
    assert main(["tap", str(file), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["run"], data["status"], data["time_s"]) == ("example", "failed", 4.0)
    assert (data["points"], data["left_out"], data["messages"]) == (400, 2, 7)
    x = {"rate_hz": 100.0, "age_s": 0.0, "unit": "m/s", "value": 16 / 3}
    assert data["signals"]["fast.x"] == x
    points = data["signals"]["fast.points"]
    assert (points["shape"], points["least"], points["largest"]) == ([2, 2], -1.5, 7.0)
    assert data["signals"]["slow.raw"]["bytes"] == 4
    assert data["signals"]["slow.late"]["value"] is None


def test_only_what_was_asked_for_is_shown(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of what means nothing it is said so, as long as something else is to be seen."""
    assert main(["tap", str(file), "slow.f*", "fats.x", "fast.x"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("t = 4.000")
    assert [row.split()[0] for row in rows[:2]] == ["fast.x", "slow.flag"]
    assert rows[2:] == [
        "no signal is called `fats.x`, or matches it",
        "failed: component `fast`: no",
    ]
    assert main(["tap", str(file), "fast.x", "fats.x", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (list(data["signals"]), data["unknown"]) == (["fast.x"], ["fats.x"])
    assert data["signals"]["fast.x"]["value"] == 16 / 3


def test_what_means_nothing_has_its_lines_within_the_height() -> None:
    table = table_of(stream(), ["fast.*", "a", "b", "slow.*"])
    lines = table.lines(60, 7)
    assert len(lines) == 6
    assert lines[3:] == [
        "and 5 more; name some, or patterns of them",
        "no signal is called `a`, or matches it",
        "no signal is called `b`, or matches it",
    ]


def test_on_a_terminal_the_table_is_drawn_in_place(
    file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr(command, "_REDRAW", 0.0)
    assert main(["tap", str(file)]) == 0
    drawn = capsys.readouterr().out
    assert drawn.startswith("\x1b[H\x1b[2Jt = 0.000 of 10 s")
    assert drawn.count("\x1b[H") == 7
    assert "t = 3.000 of 10 s" in drawn


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nowhere"], "there is no `nowhere`, neither a run directory nor a file"),
        (["."], "`.` has no tap; a run has one that goes on, with `nlosim run --tap`"),
        ([], "no run in `runs` has a tap; start one with `nlosim run --tap`"),
        (
            ["example.tap", "fats.*", "y"],
            "is called `fats.*`, `y`, or matches; of its components, did you mean `fast`?",
        ),
        (["text"], "`text`: a message of "),
        (["other"], "`other`: a message of a tap starts with b'NTAP'"),
        (["example.tap", "--rate", "51"], "expected a number above 0 and at most 50, got `51`"),
        (["example.tap", "--rate", "nan"], "expected a number above 0 and at most 50, got `nan`"),
        (["example.tap", "--seconds", "0"], "expected a number of seconds above 0, got `0`"),
        (["example.tap", "--record", "text"], "`text`: File exists"),
        (["broken"], "`broken/tap.json` cannot be read"),
        (["gone"], "nobody listens at the tap; the run has ended"),
    ],
)
def test_what_cannot_be_shown_is_said(
    file: Path,
    arguments: list[str],
    complaint: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(file.parent)
    Path("text").write_text("this is no stream")
    Path("other").write_bytes((100).to_bytes(8, "little") + bytes(100))
    for name, content in (("broken", "{"), ("gone", '{"port": 9, "token": "x"}')):
        Path(name).mkdir()
        (Path(name) / FILE).write_text(content)
    assert main(["tap", *arguments]) == 2
    assert complaint in capsys.readouterr().err


SCENARIO = """\
schema: 1
title: a walk
seed: 5
time: {stop: 600 ms}
coupling: {algorithm: jacobi}
components:
  walk: {type: "walk.py:Walk", step: 10 ms}
"""
UNIT = """\
import time
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Walk(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT, start=0.0, unit="m")}

    def setup(self, start, rng):
        self.rng, self.y = rng, 0.0

    def step(self, inputs, t, h):
        time.sleep(0.02)
        self.y += self.rng.normal()

    def outputs(self):
        return {"y": np.array(self.y)}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "walk.py").write_text(UNIT)
    (tmp_path / "walk.yaml").write_text(SCENARIO)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_live_run_is_shown_and_kept(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It has the fingerprint of a run that nobody looked at, and leaves no address behind."""
    codes: list[int] = []

    def look() -> None:
        deadline = time.monotonic() + 20
        while not list(Path("runs").glob(f"*/{FILE}")) and time.monotonic() < deadline:
            time.sleep(0.01)
        codes.append(main(["tap", "--record", "kept.tap", "--rate", "50"]))

    looking = threading.Thread(target=look)
    looking.start()
    assert main(["run", "walk.yaml", "--tap", "--quiet", "--no-figure"]) == 0
    looking.join()
    assert codes == [0]
    both = capsys.readouterr().out
    assert "walk.y" in both
    assert "\ndone\n" in both
    assert "messages in kept.tap" in both
    assert not (folder / "runs" / "walk-5" / FILE).exists()
    table = table_of(Path("kept.tap").read_bytes())
    assert table.status == "done"
    assert table.time == 600_000_000
    assert len(table.rows["walk.y"].course) > 1
    assert main(["run", "walk.yaml", "--quiet", "--no-figure", "--out", "alone"]) == 0
    alone = capsys.readouterr().out
    (one,) = (line for line in both.splitlines() if line.startswith("fingerprint"))
    assert one in alone.splitlines()
