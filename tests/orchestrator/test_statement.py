"""What two parties say of a component, and every way in which they can differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.scenario.build import load_scenario
from orchestrator.signal import Causality, Connector
from orchestrator.statement import Statement, described, differences, statement

PLAIN = Statement(
    nlosim="1",
    wire=3,
    scenario={"a": "1", "b.c": "2"},
    entry={"step": "3"},
    files={"part.py": "4"},
    connectors={"y": "output <f8"},
)


def test_who_says_the_same_agrees() -> None:
    assert differences(PLAIN, PLAIN) == []
    assert Statement.from_document(PLAIN.to_document()) == PLAIN


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"scenario": {"a": "1", "b.c": "x"}}, ["the scenario file differs in `b.c`"]),
        ({"scenario": {"a": "1"}}, ["the scenario file differs in `b.c`"]),
        ({"scenario": {"a": "1", "b.c": "2", "d": "5"}}, ["the scenario file differs in `d`"]),
        ({"entry": {"step": "x"}}, ["with what `--set` says, it differs in `step`"]),
        ({"files": {"part.py": "x"}}, ["the file `part.py` is not the same here and there"]),
        ({"files": {"other.py": "x"}}, []),
        ({"files": None}, []),
        ({"connectors": {"y": "output <f4"}}, ["`y` is output <f8 here and output <f4 there"]),
        ({"connectors": {}}, ["`y` is output <f8 here and missing there"]),
        ({"connectors": None}, []),
    ],
)
def test_each_difference_is_a_sentence(change: dict[str, object], told: list[str]) -> None:
    assert differences(PLAIN, replace(PLAIN, **change)) == told  # type: ignore[arg-type]


def test_of_another_release_nothing_else_is_said() -> None:
    other = replace(PLAIN, scenario={}, files={})
    cases = (
        ({"nlosim": "2"}, "1 is here and 2 there"),
        ({"wire": 4}, "1 is here and 1 there (messages of version 3 and 4)"),
    )
    for change, versions in cases:
        (text,) = differences(PLAIN, replace(other, **change))
        assert versions in text
        assert text.endswith("install the same release at both ends")


def test_of_many_differences_five_are_named() -> None:
    other = replace(PLAIN, scenario={f"k{n}": "x" for n in range(6)})
    (text,) = differences(replace(PLAIN, scenario={}), other)
    assert text.endswith("in `k0`, `k1`, `k2`, `k3`, `k4` and 1 more")
    (text,) = differences(replace(PLAIN, scenario={}), replace(PLAIN, scenario={"a": "1"}))
    assert text.endswith("in `a`")


def test_what_a_stranger_says_does_no_harm() -> None:
    found = Statement.from_document({"scenario": 3, "files": [1], "more": {}})
    assert (found.nlosim, found.wire, found.scenario, found.files) == ("unknown", 0, {}, None)


def test_connectors_are_described_by_what_matters() -> None:
    axes = ("vehicle", 3)
    assert described(
        {
            "x": Connector(causality=Causality.INPUT, dtype=np.float32, shape=axes, unit="m"),
            "y": Connector(causality=Causality.OUTPUT, dtype=None, mime_type="text/plain"),
        }
    ) == {"x": "input <f4 [vehicle, 3] m", "y": "output text/plain"}


SCENARIO = """\
schema: 1
title: One
time: {stop: 1 s}
components:
  a: {type: "part:Part", step: 1 s, host: there, parameters: {k: 1}}
  b: {type: "part:Part", step: 1 s}
connections: [{from: a.y, to: b.u}]
"""
PART = """\
from dataclasses import dataclass
from orchestrator import Causality, Component, Connector, parameter
class Part(Component):
    @dataclass(frozen=True, kw_only=True)
    class Parameters:
        k: int = parameter(0, doc="number")
    connectors = {"u": Connector(causality=Causality.INPUT),
                  "y": Connector(causality=Causality.OUTPUT)}
    def __init__(self, parameters): ...
    def setup(self, start, rng): ...
    def step(self, inputs, t, h): ...
    def outputs(self): ...
"""


def test_overrides_count_where_they_concern_the_component(tmp_path: Path) -> None:
    """Where it runs, and how long it may take, is up to each party."""
    (tmp_path / "one.yaml").write_text(SCENARIO)
    (tmp_path / "part.py").write_text(PART)

    def said(*overrides: str) -> Statement:
        return statement(load_scenario(tmp_path / "one.yaml", overrides), "a")

    plain = said()
    assert set(plain.files or ()) == {"part.py"}
    assert set(plain.entry) == {"type", "step", "parameters.k"}
    assert "connections[0].from" in plain.scenario
    free = ("a.host=null", "a.process=true", "a.deadline=5", "a.on_failure=abort", "b.step=0.5")
    for override in free:
        others = ["components.a.process=true"] if "deadline" in override else []
        assert said(*others, f"components.{override}") == plain
    assert said("seed=5", "time.stop=2 s") == plain
    assert differences(plain, said("components.a.parameters.k=2")) == [
        "with what `--set` says, it differs in `parameters.k`"
    ]


def test_code_that_is_not_here_has_no_digest(tmp_path: Path) -> None:
    (tmp_path / "one.yaml").write_text(SCENARIO.replace("part:Part", "none:Part", 1))
    (tmp_path / "part.py").write_text(PART)
    assert statement(load_scenario(tmp_path / "one.yaml"), "a").files is None


def test_an_installed_type_has_the_digest_of_its_module(tmp_path: Path) -> None:
    text = SCENARIO.replace('"part:Part"', "table-source", 1).replace("{k: 1}", "{file: t.csv}")
    (tmp_path / "one.yaml").write_text(text)
    (tmp_path / "part.py").write_text(PART)
    (tmp_path / "t.csv").write_text("time [s],y\n0,1\n")
    files = statement(load_scenario(tmp_path / "one.yaml"), "a").files
    assert files is not None
    assert set(files) >= {"t.csv"}
    assert any(name.startswith("adapters.tables") for name in files)


@pytest.mark.parametrize("wire", ["4", None, [], {}, 1.5])
def test_what_a_stranger_says_of_its_version_does_no_harm(wire: object) -> None:
    assert Statement.from_document({"wire": wire, "scenario": 3, "files": []}).wire == 0
