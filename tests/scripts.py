"""The scripts of the page of a run, in an engine without a browser."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


class Engine:
    """An engine in which scripts have been run."""

    def __init__(self, context: Any) -> None:
        self._context = context

    def value(self, expression: str, **names: Any) -> Any:
        """The value of an expression, through JSON.

        Args:
            expression: of JavaScript.
            names: what JSON can say, under the names by which the expression knows it.
        """
        given = "".join(f"const {name} = {json.dumps(value)};" for name, value in names.items())
        text = self._context.eval(f"(() => {{ {given} return JSON.stringify({expression}); }})()")
        return None if text is None else json.loads(text)


@contextmanager
def engine(scripts: Sequence[Path]) -> Iterator[Engine]:
    """An engine that has run these scripts; skips the test where none is installed."""
    racer = pytest.importorskip("py_mini_racer", reason="mini-racer is in the extra `dev`")
    context = racer.MiniRacer()
    try:
        for script in scripts:
            context.eval(script.read_text())
        yield Engine(context)
    finally:
        context.close()
