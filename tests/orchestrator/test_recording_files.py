"""The files of a recording while they are written."""

import errno
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.recording import blocks
from orchestrator.recording.columns import Form
from orchestrator.recording.growing import GrowingArray


@pytest.mark.parametrize(
    ("error", "is_cut_at_once"),
    [(OSError(errno.ENOSPC, "the disk is full"), True), (KeyboardInterrupt(), False)],
)
def test_a_write_that_failed_halfway_is_cut_off(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    *,
    is_cut_at_once: bool,
) -> None:
    """At once if the disk is full, else by what comes next, which is shorter than that block."""
    path = tmp_path / "part"
    file = blocks.BlockFile(path, np.dtype("<f8"), (), Form.of_rows(8, 8))
    rows = np.random.default_rng(0).random(1000)

    def fill(disk: io.FileIO, data: bytes) -> None:
        disk.write(data[: len(data) // 2])
        raise error

    file.append(rows.tobytes(), len(rows), [])
    with monkeypatch.context() as patched:
        patched.setattr(blocks, "write_all", fill)
        with pytest.raises(type(error), match="the disk is full" if is_cut_at_once else None):
            file.append(rows.tobytes(), len(rows), [])
    left = path.stat().st_size - file.size
    assert left == 0 if is_cut_at_once else left > 1000
    file.end()
    contents = blocks.scan(path)
    assert path.stat().st_size == file.size
    assert [each.rows for each in contents.blocks] == [1000]
    assert contents.ended
    assert not contents.damage


@pytest.mark.parametrize("shape", [(), (0, 3), (10,)])
@pytest.mark.parametrize("descr", ["<f8", "?", [("shape", "<i4"), ("(0", "<f8", (2,))]])
def test_a_growing_file_has_the_header_that_numpy_writes(
    tmp_path: Path, shape: tuple[int, ...], descr: Any
) -> None:
    dtype = np.dtype(descr)
    for counts in ([1], [9, 1], [99, 900, 1]):
        path = tmp_path / "growing.npy"
        array = GrowingArray(path, dtype, shape)
        for count in counts:
            array.append(np.zeros((count, *shape), dtype).tobytes(), count)
        whole = io.BytesIO()
        np.lib.format.write_array(whole, np.zeros((sum(counts), *shape), dtype), (1, 0))
        assert path.read_bytes() == whole.getvalue()
