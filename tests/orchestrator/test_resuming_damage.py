"""Checkpoints, recordings and lists of steps that are damaged, and kills while they are written."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.recording import parts
from orchestrator.resuming.continuation import continuation_of
from orchestrator.resuming.files import checkpoints_of
from orchestrator.system import System
from tests.orchestrator.resumable import MS, Noise, S, contents, interrupted, link, one, run


def test_of_a_damaged_checkpoint_the_one_before_is_used(tmp_path: Path) -> None:
    whole, _ = run(tmp_path / "whole", one(), Jacobi(), S, every=10 * S)
    folder = tmp_path / "cut"
    interrupted(folder)
    newest, before = checkpoints_of(folder)
    assert [newest.stem, before.stem] == ["500000000", "400000000"]
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 1
    newest.write_bytes(content)
    found = continuation_of(folder, {})
    assert found.time == 400 * MS
    assert "t = 0.5 s cannot be used" in found.remarks[0]
    assert "damaged: its checksum is another one" in found.remarks[0]
    fingerprint, _ = run(folder, one(), Jacobi(), S, every=100 * MS, continuation=found)
    assert fingerprint == whole


def test_a_draft_of_a_checkpoint_is_none(tmp_path: Path) -> None:
    """A kill while it is written leaves the one before."""
    interrupted(tmp_path)
    newest, _ = checkpoints_of(tmp_path)
    newest.replace(newest.with_suffix(".draft"))
    assert continuation_of(tmp_path, {}).time == 400 * MS


def test_a_recording_that_lost_something_is_made_again(tmp_path: Path) -> None:
    whole, _ = run(tmp_path / "whole", one(), Jacobi(), S, every=10 * S)
    folder = tmp_path / "cut"
    interrupted(folder)
    part = folder / "signals" / "a" / "text.zst"
    content = part.read_bytes()
    part.write_bytes(content[: len(content) // 2])
    found = continuation_of(folder, {})
    assert found.time is None
    assert len(found.remarks) == 2
    assert all("text.zst" in remark for remark in found.remarks)
    fingerprint, _ = run(folder, one(), Jacobi(), S, every=100 * MS, continuation=found)
    assert fingerprint == whole
    assert contents(folder) == contents(tmp_path / "whole")


def test_steps_that_were_lost_are_noticed(tmp_path: Path) -> None:
    def system() -> System:
        components: dict[str, Component] = {"a": Noise(), "b": Noise(is_portable=True)}
        return System(components, dict.fromkeys(components, 10 * MS), [link("b.y", "a.u")])

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, system(), Jacobi(), S, every=100 * MS, cut=550 * MS)
    path = tmp_path / "checkpoints" / "a.steps"
    path.write_bytes(path.read_bytes()[:-1])
    found = continuation_of(tmp_path, {})
    assert found.time == 400 * MS
    assert "a.steps` does not hold what it held" in found.remarks[0]


@pytest.mark.skipif(sys.platform == "win32", reason="it cannot fork")
@pytest.mark.parametrize("call", ["fsync", "truncate", "replace"])
def test_a_kill_between_any_two_calls_of_the_system_costs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    """In a copy of this process; the k-th call, of a run and of what goes on with it, is its last.

    Checkpoints are synchronised with the disk (`fsync`) and renamed (`replace`), files of a
    recording that is gone on with are cut (`truncate`).
    """
    monkeypatch.setattr(parts, "BLOCK_BYTES", 2000)

    def system() -> System:
        components: dict[str, Component] = {"a": Noise(), "b": Noise(is_portable=True)}
        wires = [link("a.y", "b.u"), link("b.y", "a.u")]
        return System(components, dict.fromkeys(components, 10 * MS), wires)

    whole, _ = run(tmp_path / "whole", system(), Jacobi(), S, every=10 * S)
    folder = tmp_path / "cut"
    with pytest.raises(KeyboardInterrupt):
        run(folder, system(), Jacobi(), S, every=100 * MS, cut=250 * MS)
    points = []
    for k in (1, 2, 3, 4, 5, 6, *LATER[call]):
        found = continuation_of(folder, {})
        assert found.remarks == ()
        points.append(found.time)
        copy = os.fork()
        if copy == 0:
            _kill_at(monkeypatch, call, k)
            try:
                run(folder, system(), Jacobi(), S, every=100 * MS, continuation=found)
            finally:
                os._exit(0)
        status = os.waitpid(copy, 0)[1]
        assert os.waitstatus_to_exitcode(status) == -signal.SIGKILL, f"call {k}"
    assert points == [t * MS for t in EXPECTED[call]]
    found = continuation_of(folder, {})
    fingerprint, _ = run(folder, system(), Jacobi(), S, every=100 * MS, continuation=found)
    assert fingerprint == whole
    assert contents(folder) == contents(tmp_path / "whole")


LATER = {"fsync": (), "truncate": (10, 13), "replace": (9, 15, 16, 17, 18, 19)}
EXPECTED = {
    "fsync": [200, 200, 200, 300, 400, 500],
    "truncate": [200] * 8,
    "replace": [200] * 10 + [300, 500],
}
"""The checkpoint that the k-th of these runs goes on from [ms]."""


def _kill_at(monkeypatch: pytest.MonkeyPatch, name: str, k: int) -> None:
    """Let the `k`-th call of a function of the system be the last thing that this process does."""
    owner = Path if name == "replace" else os
    calls, original = iter(range(k - 1)), getattr(owner, name)

    def counted(*given: object) -> object:
        if next(calls, None) is None:
            os.kill(os.getpid(), signal.SIGKILL)
        return original(*given)

    monkeypatch.setattr(owner, name, counted)


def test_a_recording_of_something_else_is_noticed(tmp_path: Path) -> None:
    """Every row can be read, and is another one."""
    interrupted(tmp_path)
    part = parts.Part(tmp_path / "signals" / "a" / "y.zst", "signals/a/y.npy", np.dtype("<f8"))
    part.append_rows(bytes(56 * 8), 56)
    part.close()
    found = continuation_of(tmp_path, {})
    assert found.time is None
    assert all("y.zst` does not hold what it held" in remark for remark in found.remarks)
    assert len(found.remarks) == 2
