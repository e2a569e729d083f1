"""Recordings: what goes in comes out, whatever happens in between."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.recording.layout import RecordingError, write_manifest
from orchestrator.recording.parts import Viewed
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder, select
from orchestrator.recording.stored import Stored
from orchestrator.signal import Causality, Connector, Signal, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Time

STEP = 10


def output(**fields: Any) -> Connector:
    return Connector(causality=Causality.OUTPUT, **fields)


def replay(connectors: Mapping[str, Connector], samples: Sequence[Signals]) -> FunctionComponent:
    """A component that outputs `samples` one by one."""
    return FunctionComponent(connectors, lambda state, inputs, t: (None, samples[t // STEP]))


def record(
    directory: Path,
    connectors: Mapping[str, Connector],
    samples: Sequence[Signals],
    **options: Any,
) -> str:
    """Record `samples` of a component called `source`; return the fingerprint."""
    system = System({"source": replay(connectors, samples)}, {"source": STEP}, [])
    recorder = Recorder(directory, **options)
    stop = (len(samples) - 1) * STEP
    simulate(system, Jacobi(), start=0, stop=stop, seed=0, observers=[recorder])
    return recorder.fingerprint


def stored(path: Path) -> np.ndarray[Any, Any]:
    rows = Stored.open(path)
    return rows[0 : len(rows)]


def equal(left: Signal, right: Signal) -> bool:
    if isinstance(left, bytes) or isinstance(right, bytes):
        return left == right
    return left.dtype == right.dtype and np.array_equal(left, right)


DTYPES = st.sampled_from(["float64", "float32", "int64", "uint8", "bool", "int16", "complex64"])
AXES = st.lists(st.one_of(st.integers(0, 3), st.sampled_from(["n", "m"])), max_size=3)


@st.composite
def recordings(draw: st.DrawFn) -> tuple[dict[str, Connector], list[dict[str, Signal]]]:
    """Connectors of all kinds, and samples that fit them."""
    connectors = {"b": output(dtype=None)}
    for k in range(draw(st.integers(1, 3))):
        connectors[f"y.{k}"] = output(dtype=draw(DTYPES), shape=tuple(draw(AXES)))
    samples = []
    for _ in range(draw(st.integers(1, 4))):
        length = {axis: draw(st.integers(0, 3)) for axis in "nm"}
        sample: dict[str, Signal] = {"b": draw(st.binary(max_size=9))}
        for name, connector in connectors.items():
            if not connector.is_binary:
                shape = tuple(length[n] if isinstance(n, str) else n for n in connector.shape)
                dtype = np.dtype(connector.dtype)
                elements = (
                    hnp.from_dtype(dtype, allow_nan=False, allow_infinity=False)
                    if dtype.kind in "fc"
                    else None
                )
                sample[name] = draw(hnp.arrays(dtype, shape, elements=elements))
        samples.append(sample)
    return connectors, samples


@settings(max_examples=60, deadline=None)
@given(content=recordings())
def test_what_goes_in_comes_out(
    content: tuple[dict[str, Connector], list[dict[str, Signal]]],
) -> None:
    connectors, samples = content
    with tempfile.TemporaryDirectory() as folder:
        fingerprint = record(Path(folder), connectors, samples)
        recording = Recording(Path(folder))
        for name, connector in connectors.items():
            series = recording[f"source.{name}"]
            assert series.times.tolist() == [k * STEP for k in range(len(samples))]
            assert series.kind == connector.kind()
            assert len(series) == len(samples)
            for k, value in enumerate(series):
                assert equal(value, samples[k][name])
                assert equal(series.at(k * STEP + STEP - 1), value)
                assert equal(series[k - len(samples)], value)
        assert recording.fingerprint() == fingerprint == recording.manifest["fingerprint"]


@settings(max_examples=30, deadline=None)
@given(content=recordings(), data=st.data())
def test_the_fingerprint_changes_with_any_bit(
    content: tuple[dict[str, Connector], list[dict[str, Signal]]], data: st.DataObject
) -> None:
    connectors, samples = content
    with tempfile.TemporaryDirectory() as folder:
        first = record(Path(folder, "a"), connectors, samples)
        assert record(Path(folder, "b"), connectors, samples) == first
        sample = data.draw(st.sampled_from(samples))
        old = sample["b"]
        assert isinstance(old, bytes)
        bit = data.draw(st.integers(0, max(8 * len(old) - 1, 0)))
        flipped = bytearray(old or b"\0")
        flipped[bit // 8] ^= 1 << bit % 8
        sample["b"] = bytes(flipped)
        assert record(Path(folder, "c"), connectors, samples) != first


def test_the_fingerprint_tells_types_apart_that_have_the_same_bytes(tmp_path: Path) -> None:
    prints = {
        record(tmp_path / kind, {"y": output(dtype=kind, shape=shape)}, [{"y": value}])
        for kind, shape, value in (
            ("int64", (2,), np.zeros(2, np.int64)),
            ("float64", (2,), np.zeros(2)),
            ("uint64", ("n",), np.zeros(2, np.uint64)),
        )
    }
    assert len(prints) == 3


def test_samples_that_are_cut_differently_differ_in_the_fingerprint(tmp_path: Path) -> None:
    connectors = {"y": output(dtype=None)}
    one = record(tmp_path / "1", connectors, [{"y": b"ab"}, {"y": b"c"}])
    other = record(tmp_path / "2", connectors, [{"y": b"a"}, {"y": b"bc"}])
    assert one != other


def test_each_part_has_a_file_and_a_layout(tmp_path: Path) -> None:
    connectors = {
        "speed": output(),
        "size": output(shape=(3,)),
        "vehicle.position": output(shape=("vehicle", 2)),
        "matrix": output(dtype=np.int32, shape=(2, "n")),
        "packets": output(dtype=None),
        "map": output(shape=("corner",), variability=Variability.FIXED),
    }
    samples: list[Signals] = [
        {
            "speed": np.array(1.5 * k),
            "size": np.full(3, float(k)),
            "vehicle.position": np.full((k, 2), float(k)),
            "matrix": np.full((2, k), k, np.int32),
            "packets": b"x" * k,
            "map": np.array([1.0, 2.0]),
        }
        for k in range(3)
    ]
    record(tmp_path, connectors, samples)
    folder = tmp_path / "signals" / "source"
    content = {path.name: stored(path).tolist() for path in folder.iterdir()}
    assert content == {
        "time.zst": [0, 10, 20],
        "speed.zst": [0.0, 1.5, 3.0],
        "size.zst": [[0.0] * 3, [1.0] * 3, [2.0] * 3],
        "vehicle.position.zst": [[1.0, 1.0], [2.0, 2.0], [2.0, 2.0]],
        "vehicle.position.rows.zst": [0, 1, 2],
        "matrix.zst": [1, 1, 2, 2, 2, 2],
        "matrix.shape.zst": [[2, 0], [2, 1], [2, 2]],
        "packets.zst": [120, 120, 120],
        "packets.rows.zst": [0, 1, 2],
        "map.zst": [1.0, 2.0],
        "map.rows.zst": [2],
    }
    recording = Recording(tmp_path)
    assert recording["source.speed"].values.tolist() == [0.0, 1.5, 3.0]
    assert recording["source.vehicle.position"].values.shape == (3, 2)
    fixed = recording["source.map"]
    assert fixed.times.tolist() == [0]
    assert equal(fixed.at(20), np.array([1.0, 2.0]))


def test_names_cannot_collide_with_parts_or_leave_the_folder(tmp_path: Path) -> None:
    """FMUs name their variables as they please."""
    names = ["time", "y", "y.rows", "y.shape", "../up", "der(x)[1]", "a/b", "50%", "tim%65", "é"]
    connectors = {name: output(shape=("n",), dtype=np.int64) for name in names}
    values = {name: np.full(1, k) for k, name in enumerate(names)}
    record(tmp_path, connectors, [values])
    recording = Recording(tmp_path)
    assert set(recording.signals) == {f"source.{name}" for name in names}
    for name in names:
        assert equal(recording[f"source.{name}"][0], values[name])
    assert {path.parent for path in tmp_path.rglob("*.zst")} == {tmp_path / "signals" / "source"}


def test_large_recordings_are_not_held_in_memory(tmp_path: Path) -> None:
    """A sample as large as a block is on disk at once, before the run ends."""
    connectors = {"y": output(shape=(600_000,))}
    noise = np.random.default_rng(0).random(600_000)
    seen: list[int] = []

    def function(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        seen.append(sum(path.stat().st_size for path in tmp_path.rglob("y.zst")))
        return None, {"y": noise + t}

    system = System({"source": FunctionComponent(connectors, function)}, {"source": STEP}, [])
    simulate(system, Jacobi(), start=0, stop=2 * STEP, seed=0, observers=[Recorder(tmp_path)])
    # 49 random bits of each number remain
    assert 3_600_000 < seen[-1] - seen[1] <= 4_800_000
    first = Recording(tmp_path)["source.y"].values[:, 0]
    assert first.tolist() == [noise[0], noise[0] + 10.0, noise[0] + 20.0]


KILLED = """
    import os, signal, sys, time
    from pathlib import Path
    import numpy as np
    import orchestrator.recording.recorder

    from orchestrator import (
        Causality, Connector, Jacobi, Recorder, System, simulate,
    )
    from orchestrator.testing import FunctionComponent

    orchestrator.recording.recorder.FLUSH_INTERVAL = 0.0
    axes = {"y": (), "ragged": ("n", 2)}
    connectors = {k: Connector(causality=Causality.OUTPUT, shape=s) for k, s in axes.items()}
    connectors["packets"] = Connector(causality=Causality.OUTPUT, dtype=None)

    def function(state, inputs, t):
        if t == 50:
            DIE
        k = t // 10
        return None, {"y": np.array(float(t)), "ragged": np.full((k, 2), float(k)),
                      "packets": bytes(k)}

    system = System({"a": FunctionComponent(connectors, function)}, {"a": 10}, [])
    simulate(system, Jacobi(), start=0, stop=100, seed=0, observers=[Recorder(Path(sys.argv[1]))])
"""


def run_and_die(directory: Path, how: str) -> int:
    script = textwrap.dedent(KILLED).replace("DIE", how)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", script, str(directory)],
        env=environment,
        check=False,
        capture_output=True,
        timeout=60,
    )
    return done.returncode


@pytest.mark.parametrize(
    ("how", "code", "status"),
    [
        ("os._exit(9)", 9, "running"),
        ("os.kill(os.getpid(), 9)", -signal.SIGKILL, "running"),
        ("signal.raise_signal(signal.SIGINT); time.sleep(5)", -signal.SIGINT, "interrupted"),
        ("raise ValueError('no')", 1, "failed"),
    ],
)
def test_a_recording_that_was_cut_short_is_readable(
    tmp_path: Path, how: str, code: int, status: str
) -> None:
    assert run_and_die(tmp_path, how) == code
    recording = Recording(tmp_path)
    assert recording.manifest["status"] == status
    assert recording["a.y"].times.tolist() == [0, 10, 20, 30, 40]
    assert recording["a.y"].values.tolist() == [0.0, 10.0, 20.0, 30.0, 40.0]
    assert [np.shape(value) for value in recording["a.ragged"]] == [(k, 2) for k in range(5)]
    assert list(recording["a.packets"]) == [bytes(k) for k in range(5)]
    assert recording.damage == ()
    for path in tmp_path.rglob("*.npy"):  # what is not in a block yet, for anybody
        np.load(path)


def test_fewer_times_than_values_are_as_many_samples(tmp_path: Path) -> None:
    """Killed between two writes."""
    for count in (3, 5):
        samples = [{"y": np.array(float(k))} for k in range(count)]
        record(tmp_path / str(count), {"y": output()}, samples)
    times = tmp_path / "3" / "signals" / "source" / "time.zst"
    times.replace(tmp_path / "5" / "signals" / "source" / "time.zst")
    assert Recording(tmp_path / "5")["source.y"].values.tolist() == [0.0, 1.0, 2.0]


def test_the_manifest_says_what_was_run_and_how_it_ended(tmp_path: Path) -> None:
    samples = [{"y": np.array(0.0)}, {"y": np.array(np.nan)}]
    with pytest.raises(ComponentError):
        record(tmp_path / "failed", {"y": output()}, samples, manifest={"seed": 7})
    manifest = Recording(tmp_path / "failed").manifest
    assert manifest["seed"] == 7
    assert manifest["status"] == "failed"
    assert manifest["error"] == "component `source` at t = 0 s: output `y` is nan at index []"
    assert (manifest["start_ns"], manifest["stop_ns"], manifest["reached_ns"]) == (0, 10, 0)
    assert set(manifest["wall_time_s"]["components"]) == {"source"}
    record(tmp_path / "done", {"y": output()}, samples[:1])
    manifest = Recording(tmp_path / "done").manifest
    assert (manifest["status"], manifest["error"]) == ("done", None)


def test_the_manifest_is_replaced_in_one_piece(tmp_path: Path) -> None:
    write_manifest(tmp_path, {"status": "running"})
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_manifest(tmp_path, {"status": "done", "speed": float("nan")})
    assert json.loads((tmp_path / "manifest.json").read_text()) == {"status": "running"}


def test_patterns_select_what_is_recorded(tmp_path: Path) -> None:
    connectors = {name: output() for name in ("vehicle.id", "vehicle.size", "gap")}
    samples = [{name: np.array(0.0) for name in connectors}]
    options = {"include": ["source.vehicle.*", "*.gap"], "exclude": ["*.size"]}
    record(tmp_path, connectors, samples, **options)
    assert Recording(tmp_path).signals == ("source.gap", "source.vehicle.id")


def test_a_pattern_that_matches_nothing_is_a_problem() -> None:
    system = System({"source": replay({"gap": output()}, [])}, {"source": STEP}, [])
    with pytest.raises(SystemStructureError) as error:
        select(system, ["source.gab", "x.*", "*"], [])
    assert error.value.problems == (
        "cannot record `source.gab`: no output matches; did you mean `source.gap`?",
        "cannot record `x.*`: no output matches; there are: source.gap",
    )


def test_values_that_have_no_bytes_are_refused() -> None:
    system = System({"source": replay({"text": output(dtype=object)}, [])}, {"source": STEP}, [])
    with pytest.raises(
        SystemStructureError, match=r"cannot record `source.text`: .*object.*exclude"
    ):
        select(system, ["*"], [])
    assert select(system, ["*"], ["source.text"]) == ()


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    samples = [{"y": np.array(1.0)}]
    record(tmp_path, {"y": output()}, samples)
    with pytest.raises(RecordingError, match="holds a recording; choose another directory"):
        record(tmp_path, {"y": output()}, samples)
    assert Recording(tmp_path).manifest["status"] == "done"


def test_a_recording_is_gone_through_by_the_names_of_its_signals(tmp_path: Path) -> None:
    record(tmp_path, {"y": output(), "x": output()}, [{"y": np.array(1.0), "x": np.array(2.0)}])
    recording = Recording(tmp_path)
    assert (*recording,) == recording.signals == ("source.x", "source.y")
    assert len(recording) == 2
    assert [recording[name].values.tolist() for name in recording] == [[2.0], [1.0]]


def test_questions_that_have_no_answer_are_answered_with_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"holds no recording: no `signals/index.json`"):
        Recording(tmp_path)
    with pytest.raises(RecordingError, match=r"^there is no directory `.*nothing`$"):
        Recording(tmp_path / "nothing")
    system = System({"late": replay({"y": output()}, [{"y": np.array(1.0)}] * 3)}, {"late": 10}, [])
    simulate(system, Jacobi(), start=10, stop=20, seed=0, observers=[Recorder(tmp_path)])
    recording = Recording(tmp_path)
    assert "late.y" in recording
    assert "late.z" not in recording
    with pytest.raises(RecordingError, match=r"no signal `lat.y`; did you mean `late.y`\?"):
        recording["lat.y"]
    series = recording["late.y"]
    with pytest.raises(
        RecordingError, match=r"`late.y` has no value at 5e-09 s; the first is at 1e"
    ):
        series.at(5)
    with pytest.raises(IndexError, match=r"`late.y` has 2 samples, there is no sample 2"):
        series[2]


def test_half_a_second_passes_from_the_first_sample_to_the_first_flush(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long the components took to start: flushing one sample each would save nothing."""
    now = 100.0
    monkeypatch.setattr("orchestrator.recording.recorder.monotonic", lambda: now)
    recorder = Recorder(tmp_path)
    values = {"source": {"x": np.array(1.0)}}
    system = System({"source": replay({"x": output()}, [values["source"]])}, {"source": STEP}, [])
    recorder.begin(system, 0, 10 * STEP)
    found = []
    for k, moment in enumerate((200.0, 200.4, 200.6, 201.0, 201.2)):
        now = moment
        recorder.observe(k * STEP, ("source",), values)
        found.append(len(Stored.open(tmp_path / "signals" / "source" / "x.zst")))
    assert found == [0, 0, 3, 3, 5]


def test_memory_of_a_part_is_thrown_away_before_its_views_without_a_word() -> None:
    """`io.BytesIO` refuses, which Python prints from 3.13 on where an error ends a recording."""
    memory = Viewed(b"abc")
    view = memory.getbuffer()
    memory.close()
    assert view.tobytes() == b"abc"
    view.release()
    memory.close()
    assert memory.closed
