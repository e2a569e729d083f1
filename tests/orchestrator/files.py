"""Scenario files that are changed, and the places in what is read of one."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from orchestrator.errors import Problem, ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Address


def change(path: Path, *changes: tuple[str, str]) -> None:
    """Replace text in a file, old by new; each old text must be there once."""
    text = path.read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text)


def problems_after(path: Path, *changes: tuple[str, str]) -> tuple[Problem, ...]:
    """The problems of a scenario after replacing text in its file."""
    change(path, *changes)
    with pytest.raises(ScenarioError) as error:
        load_scenario(path)
    return error.value.problems


def addresses(value: Any, address: Address = ()) -> Iterator[Address]:
    """The address of every value of a document, from the top on."""
    yield address
    children = enumerate(value) if isinstance(value, list) else ()
    for key, child in value.items() if isinstance(value, dict) else children:
        yield from addresses(child, (*address, key))
