"""The compiled engine is used if it belongs to this release."""

import ctypes

import pytest

from orchestrator.plan import layouts


def test_an_engine_of_another_release_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is told from others by the sizes of its structures."""
    find = layouts.engine.__wrapped__
    assert find() is not None
    for k in range(len(layouts.STRUCTURES)):
        changed = (*layouts.STRUCTURES[:k], ctypes.c_int16, *layouts.STRUCTURES[k + 1 :])
        monkeypatch.setattr(layouts, "STRUCTURES", changed)
        assert find() is None
        monkeypatch.undo()
