"""Texts of FMUs are signals: they start, travel, are recorded, and are refused if they are none."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from adapters.fmi.component import RestorableFmuComponent
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.connection import Connection, Endpoint
from orchestrator.errors import ComponentError
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import TEXT, Causality, Connector, Signal, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, Time

STEP = 1_000_000_000
INPUTS: Mapping[str, Signal] = {
    "word": b"eins",
    "pair[0]": b"zwei",
    "pair[1]": "Grüße".encode(),
    "bits[0, 0]": b"\0\1",
    "bits[0, 1]": b"",
}


def begun(
    path: Path, inputs: Mapping[str, Signal] = INPUTS, **values: object
) -> RestorableFmuComponent:
    component = FmuComponentType(path).create("unit", values)
    assert isinstance(component, RestorableFmuComponent)
    component.setup(0, np.random.default_rng(1))
    component.initialise(inputs)
    return component


def test_every_element_is_a_connector(words3: Path) -> None:
    component = FmuComponentType(words3).create("unit", {})
    connectors = component.connectors
    assert [n for n, c in connectors.items() if c.causality is Causality.INPUT] == list(INPUTS)
    assert {n: c.start_value() for n, c in connectors.items() if n in INPUTS} == {
        "word": b"one",
        "pair[0]": b"two",
        "pair[1]": b"three",
        "bits[0, 0]": b"\0\xff",
        "bits[0, 1]": b"\0\xff",
    }
    assert connectors["pair[1]"].mime_type == TEXT
    assert connectors["pair[1]"].kind() == "text"
    assert connectors["pair_out[1]"].feedthrough == {"pair[0]", "pair[1]"}
    assert connectors["bits_out[0, 1]"].mime_type == "application/x-bits"
    assert not any(name.startswith("sized") for name in connectors)
    assert "`sized` (String of variable size)" in FmuComponentType(words3).description


def test_texts_come_back_as_they_went(words3: Path) -> None:
    component = begun(words3)
    expected = {
        "word_out": b"eins",
        "pair_out[0]": b"zwei",
        "pair_out[1]": "Grüße".encode(),
        "bits_out[0, 0]": b"\0\1",
        "bits_out[0, 1]": b"",
        "title_out": b"four",
        "list_out[0]": b"five",
        "list_out[1]": b"six",
    }
    assert component.outputs() == expected
    component.step({**INPUTS, "pair[1]": b"drei"}, 0, STEP)
    assert component.outputs() == {**expected, "pair_out[1]": b"drei"}
    component.close()


def test_an_element_that_changes_after_a_return_brings_the_others_of_that_time(
    words3: Path,
) -> None:
    component = begun(words3)
    state = component.save()
    component.step({**INPUTS, "pair[0]": b"late", "pair[1]": b"later"}, 0, STEP)
    component.restore(state)
    component.step({**INPUTS, "pair[1]": b"drei"}, 0, STEP)
    outputs = component.outputs()
    assert (outputs["pair_out[0]"], outputs["pair_out[1]"]) == (b"zwei", b"drei")
    component.close()


def test_parameters_and_start_values_are_texts(words3: Path) -> None:
    parameters = FmuComponentType(words3).parameters
    assert parameters["title"].default == "four"
    assert parameters["list"].default == ("five", "six")
    component = begun(words3, title="vier", list=("fünf", "sechs"))
    assert component.outputs()["title_out"] == b"vier"
    assert component.outputs()["list_out[0]"] == "fünf".encode()
    assert component.outputs()["list_out[1]"] == b"sechs"
    component.close()
    starts: dict[str, Any] = {"start.pair": ("a", "b"), "list": ("both",)}
    component = begun(words3, **starts)
    assert component.outputs()["list_out[1]"] == b"both"
    assert component.connectors["pair[1]"].start_value() == b"b"
    component.close()


def test_what_is_no_text_ends_the_run(words3: Path, tmp_path: Path) -> None:
    """`words3` says it after the step that begins at 9 s."""
    component = FmuComponentType(words3).create("unit", {})
    system = System({"unit": component}, {"unit": STEP}, [])
    said = r"`unit` at t = 9 s: output `word_out` is no text in UTF-8: b'\xff\xfe' at 2"
    with pytest.raises(ComponentError, match=re.escape(said)):
        simulate(
            system, Jacobi(), start=0, stop=12 * STEP, seed=1,
            observers=[Recorder(tmp_path / "run")],
        )  # fmt: skip


class Teller(Component):
    """Says `before` until 3 s and `after` from then on."""

    connectors: Mapping[str, Connector] = {
        "word": Connector(causality=Causality.OUTPUT, dtype=None, mime_type=TEXT)
    }

    def __init__(self, after: bytes) -> None:
        self._after = after
        self._word = b"before"

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._word = b"before"

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if t + h >= 3 * STEP:
            self._word = self._after

    @override
    def outputs(self) -> Signals:
        return {"word": self._word}


def heard(product2: Path, folder: Path, said: bytes, *, compiled: bool) -> list[Signal]:
    """What `product2`, which steps ten times a second, hears at 0.9, 4 and 5 s."""
    components: dict[str, Component] = {
        "teller": Teller(said),
        "product": FmuComponentType(product2).create("product", {}),
    }
    link = Connection(Endpoint("teller", "word"), Endpoint("product", "said"))
    system = System(components, {"teller": STEP, "product": STEP // 10}, [link])
    observers = [Recorder(folder / str(compiled))]
    simulate(
        system, Jacobi(), start=0, stop=5 * STEP, seed=1, observers=observers, compiled=compiled
    )
    series = Recording(folder / str(compiled))["product.heard"]
    return [series.at(9 * STEP // 10), series.at(4 * STEP), series.at(5 * STEP)]


TEXTS = ["", "z", "é", "\u07ff", "\u0800", "\ud7ff", "\ue000", "\uffff", "\U00010000", "\U0010ffff"]
NO_TEXTS = [
    "80", "c1bf", "c2", "c27f", "c2c0", "e09fbf", "e0a0", "eda080", "efbf7f", "efbfc0", "f08fbfbf",
    "f0908080ff", "f4908080", "f5808080", "f0bfbf",
]  # fmt: skip


@pytest.mark.parametrize("text", TEXTS)
def test_any_text_passes_compiled_code(product2: Path, tmp_path: Path, text: str) -> None:
    for compiled in (False, True):
        found = heard(product2, tmp_path, text.encode(), compiled=compiled)
        assert found == [b"heard: before", *[f"heard: {text}".encode()] * 2]


@pytest.mark.parametrize("digits", NO_TEXTS)
def test_no_other_bytes_do(product2: Path, tmp_path: Path, digits: str) -> None:
    """Compiled code finds what Python finds."""
    with pytest.raises(UnicodeDecodeError):
        bytes.fromhex(digits).decode()
    said = []
    for compiled in (False, True):
        with pytest.raises(ComponentError, match="output `heard` is no text in UTF-8") as caught:
            heard(product2, tmp_path, f"hex:{digits}".encode(), compiled=compiled)
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_a_text_ends_with_nul_so_that_none_has_one(product2: Path, tmp_path: Path) -> None:
    with pytest.raises(ComponentError, match="output `word` has a NUL character at 1"):
        heard(product2, tmp_path, b"a\0b", compiled=False)


SCENARIO = """
schema: 1
title: Texts
time: {stop: 3 s}
components:
  a: {fmu: WORDS, step: 1 s, parameters: {title: Ada, start.word: begin}}
  b: {fmu: PRODUCT, step: 1 s, parameters: {prefix: "she said "}}
connections:
  - {from: a.title_out, to: b.said}
  - {value: hello, to: "a.pair[0]"}
"""


def test_texts_are_connected_and_recorded(words3: Path, product2: Path, tmp_path: Path) -> None:
    """From FMI 3.0 to FMI 2.0; the fingerprint is the same in processes of their own."""
    text = SCENARIO.replace("WORDS", str(words3)).replace("PRODUCT", str(product2))
    fingerprints = set()
    for processes in (False, True):
        scenario = tmp_path / "words.yaml"
        scenario.write_text(text.replace("{fmu", "{process: true, fmu") if processes else text)
        out = tmp_path / str(processes)
        assert main(["run", str(scenario), "--out", str(out)]) == 0
        recording = Recording(out)
        fingerprints.add(recording.fingerprint())
        assert recording["a.word_out"].at(0) == b"begin"
        assert recording["a.pair_out[0]"].at(3 * STEP) == b"hello"
        assert recording["b.heard"].at(0) == b"she said Ada"
        assert recording["b.heard"].kind == "text"
    assert len(fingerprints) == 1


def test_text_drives_text_only(
    words3: Path, product2: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SCENARIO.replace("WORDS", str(words3)).replace("PRODUCT", str(product2))
    text = text.replace("a.title_out, to: b.said", '"a.bits_out[0, 0]", to: b.said')
    scenario = tmp_path / "words.yaml"
    scenario.write_text(text.replace("value: hello", "value: 1"))
    assert main(["check", str(scenario)]) == 2
    said = "".join(capsys.readouterr())
    assert "contents differ: application/x-bits and text/plain" in said
    assert "expected a text, as it is text" in said
    scenario.write_text(text.replace("value: hello", 'value: "a\\0b"'))
    assert main(["check", str(scenario)]) == 2
    assert "has a NUL character at 1" in "".join(capsys.readouterr())
