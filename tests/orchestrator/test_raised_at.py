"""Where an exception came from: the innermost line of the component's own code."""

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from orchestrator.errors import ComponentError, ScenarioError
from orchestrator.raised_at import raised_at

UNIT = """\
import json

import helper
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Unit(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT)}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        helper.help()  # line 15

    def outputs(self):
        return {}


def parse():
    json.loads("{")  # line 22
"""
HELPER = """\
def help():
    deeper()


def deeper():
    raise KeyError("nobody")  # line 6
"""


@pytest.fixture
def unit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    (tmp_path / "unit.py").write_text(UNIT)
    (tmp_path / "helper.py").write_text(HELPER)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "helper", raising=False)
    spec = importlib.util.spec_from_file_location("unit", tmp_path / "unit.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_is_the_innermost_line_of_the_own_folder(unit: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(KeyError) as caught:
        unit.Unit().step({}, 0, 1)
    trace = caught.value.__traceback__
    assert trace is not None
    caught.value.__traceback__ = trace.tb_next  # without this test
    assert raised_at(caught.value) == f"{tmp_path / 'helper.py'}:6, in deeper"


def test_what_others_raise_is_told_where_they_were_called(unit: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="Expecting property name") as caught:
        unit.parse()
    trace = caught.value.__traceback__
    assert trace is not None
    caught.value.__traceback__ = trace.tb_next
    assert raised_at(caught.value) == f"{tmp_path / 'unit.py'}:22, in parse"


def test_what_was_never_raised_is_nowhere() -> None:
    assert raised_at(ValueError("never")) == ""
    assert ComponentError("a", 0, "b").where == ""
    assert raised_at(ScenarioError([])) == ""


DERIVED = """\
import helper


class Derived:
    def step(self):
        helper.call(self)

    def own(self):
        raise KeyError("mine")  # line 9
"""
CALLER = """\
def call(other):
    other.own()
"""


def test_a_class_that_derives_from_one_elsewhere_is_told_its_own_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Methods of the base, in another folder, are called first; `owner` says who it is."""
    for folder, name, text in (("base", "base", CALLER), ("own", "own", DERIVED)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{name}.py").write_text(text.replace("import helper\n", ""))
        monkeypatch.syspath_prepend(tmp_path / folder)
        monkeypatch.delitem(sys.modules, name, raising=False)
    base, own = importlib.import_module("base"), importlib.import_module("own")
    with pytest.raises(KeyError) as caught:
        base.call(own.Derived())
    trace = caught.value.__traceback__
    assert trace is not None
    caught.value.__traceback__ = trace.tb_next
    assert raised_at(caught.value) == f"{tmp_path / 'base' / 'base.py'}:2, in call"
    line = f"{tmp_path / 'own' / 'own.py'}:8, in own"
    assert raised_at(caught.value, own.Derived) == line
    assert raised_at(caught.value, ComponentError) == f"{tmp_path / 'base' / 'base.py'}:2, in call"
