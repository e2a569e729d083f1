"""Ctrl-C at the worst of moments."""

import signal
import sys

import pytest


class InterruptedDestructor:
    """Something whose destructor is interrupted."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def record_ignored(monkeypatch: pytest.MonkeyPatch) -> list[type[BaseException]]:
    """The types of what is raised in destructors, which Python ignores, from now on."""
    types: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda given: types.append(given.exc_type))
    return types
