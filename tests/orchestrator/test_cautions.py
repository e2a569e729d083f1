"""Values of parameters that bias results: declared with the parameter, said in the summary."""

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from adapters.fmi.caution import cautions as annotated
from fmus.channel.caution import UNNOTICED
from orchestrator import registry
from orchestrator.caution import Caution
from orchestrator.cli import main
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.cautions import cautions

MODULE = """\
from dataclasses import dataclass
import numpy as np
from orchestrator.caution import Caution
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector
from orchestrator.component import Component


class Scale(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT)}

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        is_calibrated: bool = parameter(True, doc="x", caution=Caution(False, "it weighs too much"))
        gain: int = parameter(1, doc="x", caution=Caution(0, "it weighs nothing"))

    def __init__(self, parameters):
        pass

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        pass

    def outputs(self):
        return {"y": np.zeros(())}
"""


@pytest.fixture
def scale(tmp_path: Path) -> Callable[[str], Path]:
    """A scenario of a scale with these parameters."""
    (tmp_path / "scale_parts.py").write_text(MODULE)

    def scenario(parameters: str) -> Path:
        path = tmp_path / "scale.yaml"
        path.write_text(
            "schema: 1\ntitle: A scale\ntime: {stop: 100 ms}\ncomponents:\n"
            f"  one: {{type: scale_parts:Scale, step: 100 ms, parameters: {{{parameters}}}}}\n"
        )
        return path

    return scenario


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ("", []),
        ("is_calibrated: true, gain: 1", []),
        ("is_calibrated: false", ["`one.is_calibrated` is false: it weighs too much"]),
        ("gain: 0", ["`one.gain` is 0: it weighs nothing"]),
    ],
)
def test_a_value_is_told_only_where_it_was_chosen(
    parameters: str, said: list[str], scale: Callable[[str], Path]
) -> None:
    assert list(cautions(load_scenario(scale(parameters)))) == said


def test_summary_json_manifest_and_report_say_it(
    scale: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, sentence = scale("gain: 0"), "`one.gain` is 0: it weighs nothing"
    words = ["run", str(path), "--quiet", "--no-figure"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 0
    assert f"biased       {sentence}\n" in capsys.readouterr().out
    assert main([*words, "--out", str(tmp_path / "b"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["cautions"] == [sentence]
    assert json.loads((tmp_path / "a" / "manifest.json").read_text())["cautions"] == [sentence]
    assert sentence in (tmp_path / "a" / "log.txt").read_text()
    assert main(["report", str(tmp_path / "a")]) == 0
    assert f"biased: {sentence}" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["channel", "channel-constant-per", "channel-trace"])
def test_every_channel_warns_of_receptions_that_it_does_not_tell(name: str) -> None:
    parameters = registry.component_type(name).parameters
    warned = {key: each.caution for key, each in parameters.items() if each.caution is not None}
    assert warned == {"weak_receptions": UNNOTICED}
    assert UNNOTICED.value is False


def test_annotations_that_nobody_understands_are_ignored() -> None:
    def variable(kind: str, name: str, value: str) -> str:
        annotation = '<Annotation type="io.github.nlosim.caution">'
        said = f'{annotation}<Caution value="{value}"> why </Caution></Annotation>'
        return f'<{kind} name="{name}"><Annotations>{said}</Annotations></{kind}>'

    variables = [
        variable("Boolean", "b", "true"),
        variable("Float64", "f", "0.5"),
        variable("Float64", "g", "half"),
        variable("Boolean", "c", "maybe"),
        variable("String", "s", "off"),
        '<Float64 name="plain"/>',
    ]
    root = ET.fromstring(f"<f><ModelVariables>{''.join(variables)}</ModelVariables></f>")  # noqa: S314
    assert annotated(root) == {
        "b": Caution(value=True, meaning="why"),
        "f": Caution(value=0.5, meaning="why"),
        "s": Caution(value="off", meaning="why"),
    }
