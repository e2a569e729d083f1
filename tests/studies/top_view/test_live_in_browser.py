"""A run is followed in a browser: newer pages take the place of older ones, choices stay."""

from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.page.live import making
from orchestrator.page.live.making import LivePages
from orchestrator.page.live.server import served
from orchestrator.recording.layout import read_json, write_manifest
from tests.browser import browser, browser_path

pytestmark = pytest.mark.skipif(browser_path() is None, reason="no browser")

SCENARIO = Path(__file__).parents[3] / "scenarios" / "red_light.yaml"
INSIDE = "document.querySelector('iframe:not(.coming)').contentWindow.NLOSIM.page"
LAG = "(document.getElementById('lag')?.textContent || '')"


def run(folder: Path, stop: str, status: str) -> Path:
    sets = ["--set", f"time.stop={stop}", "--set", "measures={}", "--set", "report=null"]
    out = folder / f"{status}-{stop[0]}"
    assert main(["run", str(SCENARIO), *sets, "--quiet", "--no-page", "--out", str(out)]) == 0
    write_manifest(out, {**read_json(out / "manifest.json"), "status": status})
    return out


@pytest.mark.slow
def test_a_run_is_followed_with_what_was_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(making, "_OFTEN", 0.0)
    early, late = run(tmp_path, "1 s", "running"), run(tmp_path, "3 s", "running")
    done = run(tmp_path, "3 s", "done")
    pages = LivePages(early)
    pages.make()
    with browser(tmp_path / "browser") as tab, served(pages, "127.0.0.1", 0) as url:
        tab.resize(900, 700)
        tab.call("Page.navigate", url=url)
        tab.wait(f"{LAG}.startsWith('The run is at 1.00 s. Shown: 1.00 s')")
        tab.evaluate(
            f"{INSIDE}.view.select(2); {INSIDE}.view.camera.show({{x: 7, y: 8, scale: 3}});"
            f"{INSIDE}.view.follow(-1); {INSIDE}.view.choices.set('zones', true)"
        )
        chosen = tab.evaluate(f"{INSIDE}.view.crowd.ids[2]")
        pages.directory = late
        pages.make()
        tab.wait(f"{INSIDE}.clock.span === 3")
        tab.wait(f"{LAG}.includes('Shown: 3.00 s, 0.00 s behind.')")
        assert tab.evaluate(f"{INSIDE}.view.crowd.ids[{INSIDE}.view.selected]") == chosen
        assert tab.evaluate(f"(({{x, y, scale}}) => [x, y, scale])({INSIDE}.view.camera)") == [
            7, 8, 3,
        ]  # fmt: skip
        assert tab.evaluate(f"{INSIDE}.view.shows('zones')") is True
        tab.evaluate(f"{INSIDE}.clock.seek(0.5)")
        tab.wait(f"{LAG}.endsWith('2.50 s behind; it is not followed.')")
        pages.directory = done
        pages.make()
        tab.wait(f"{LAG} === 'The run is done at 3.00 s. Shown: 0.50 s.'")
        tab.wait("document.querySelectorAll('iframe').length === 1")
        assert tab.errors == []
