"""Layers of a page: the example of the manual works as it stands, in a package of its own."""

import json
import re
from pathlib import Path

import pytest
from typing_extensions import override

from orchestrator.cli import main
from orchestrator.page import layer
from tests.browser import browser
from tests.installation import install
from tests.orchestrator.conftest import SAMPLE_UNITS

MANUAL = (Path(__file__).parents[3] / "docs" / "run-page.md").read_text()
NOTHING = "tests.orchestrator.page.test_layers:Nothing"


class Nothing(layer.PageLayer):
    """Has nothing to show of any run."""

    @override
    def content(self, run: layer.PageOfRun) -> None:
        del run

    @override
    def scripts(self) -> list[Path]:
        raise AssertionError("who shows nothing has no scripts on the page")


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The page of a run with a speed, made with the layer of the manual and another one."""
    for language, comment in (("python", "#"), ("javascript", "//")):
        (block,) = re.findall(rf"```{language}\n(.*?)```", MANUAL, re.DOTALL)
        name = re.match(rf"{comment} (\S+)", block)
        assert name is not None
        path = tmp_path / name[1]
        path.parent.mkdir(exist_ok=True)
        path.write_text(block)
    (entry,) = re.findall(r'^record = "(.*)"$', MANUAL, re.MULTILINE)
    monkeypatch.syspath_prepend(tmp_path)
    components = {"table-source": "adapters.tables:TableSource"}
    groups = {**SAMPLE_UNITS, "orchestrator.components": components}
    install(monkeypatch, {**groups, layer.GROUP: {"record": entry, "nothing": NOTHING}})
    (tmp_path / "drive.csv").write_text("time,speed [m/s]\n0,1\n1,5.25\n2,2\n")
    scenario = tmp_path / "drive.yaml"
    scenario.write_text(
        "schema: 1\ntitle: A drive\ntime: {stop: 2 s}\ncomponents:\n"
        "  car:\n    type: table-source\n"
        "    step: 1 s\n    parameters: {file: drive.csv}\nconnections: []\n"
    )
    out = tmp_path / "run"
    assert main(["run", str(scenario), "--quiet", "--json", "--out", str(out)]) == 0
    return out / "index.html"


def test_a_layer_is_on_the_page_with_its_data_and_its_scripts(page: Path) -> None:
    text = page.read_text()
    found = re.search(r'id="data">(.*?)</script>', text)
    assert found is not None
    assert list(json.loads(found[1])["layers"]) == ["record"]
    assert "NLOSIM.layers.record" in text


@pytest.mark.slow
def test_a_layer_shows_what_it_knows(page: Path, tmp_path: Path) -> None:
    with browser(tmp_path / "browser") as tab:
        tab.open(page)
        said = []
        for time in (0, 1, 2):
            tab.evaluate(f"NLOSIM.page.clock.seek({time})")
            tab.frames(3)
            said.append(tab.evaluate("document.querySelector('.section .body').textContent"))
        assert said == ["1.00 m/s", "5.25 m/s", "5.25 m/s"]
        assert tab.errors == []
