"""The page of an experiment as a person would use it, in a headless browser, where there is one."""

import csv
import io
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from orchestrator.experiment.page.page import make_page
from tests.browser import Tab, browser
from tests.orchestrator.page.results import conducted
from tests.orchestrator.page.test_experiment_page import EVIL, became, small

PAGE = "NLOSIM.page"
SVG = "{http://www.w3.org/2000/svg}"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sixteen runs, one of which failed; of one the directory was kept, with a page."""
    folder = conducted(tmp_path_factory.mktemp("street") / "out", small(), became)
    kept = folder / "runs" / "1-seed-2"
    kept.mkdir(parents=True)
    (kept / "index.html").touch()
    return make_page(folder)


@pytest.fixture(scope="module")
def opened(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        tab.open(page)
        yield tab


@pytest.fixture
def tab(opened: Tab) -> Iterator[Tab]:
    """The page as it opens; nothing may be said on the console."""
    opened.resize(1280, 900)
    opened.evaluate(
        f"{PAGE}.select(null); {PAGE}.show(NLOSIM.firstView({PAGE}.results));"
        f"{PAGE}.filter.value = ''; {PAGE}.filter.dispatchEvent(new Event('input')); scrollTo(0, 0)"
    )
    yield opened
    assert opened.errors == []


def card(tab: Tab) -> str:
    said: str = tab.evaluate("document.querySelector('.run-card').innerText")
    return said


def test_nothing_is_asked_for_from_elsewhere(tab: Tab, page: Path) -> None:
    assert tab.requests == [page.as_uri()]


def test_the_head_says_what_was_asked(tab: Tab) -> None:
    said = tab.evaluate("document.getElementById('head').innerText")
    assert said.split()[:3] == ["street", "runs", "16"]
    assert "With <b>cars</b>." in said
    assert "[object" not in tab.evaluate("document.body.innerText")


def test_a_click_on_a_dot_shows_its_run_and_its_command(tab: Tab) -> None:
    x, y, run = tab.evaluate(
        f"(() => {{ const chart = {PAGE}.charts.spread; chart.whole.scrollIntoView();"
        "const area = chart.whole.querySelector('svg').getBoundingClientRect();"
        "const { x, y, run } = chart.points[0]; return [area.left + x, area.top + y, run]; })()"
    )
    tab.click(x, y)
    assert tab.evaluate(f"{PAGE}.chosen") == run
    command = tab.evaluate(f"{PAGE}.results.command({run})")
    seed = tab.evaluate(f"{PAGE}.results.seedOf({run})")
    assert f"Run: seed {seed}" in card(tab)
    assert "".join(command.split()) in "".join(card(tab).split())


def test_a_kept_run_is_a_link_away(tab: Tab, page: Path) -> None:
    tab.evaluate(f"{PAGE}.select(1)")
    link = tab.evaluate("document.querySelector('.run-card a').getAttribute('href')")
    assert link == "runs/1-seed-2/index.html"
    directory = page.parent / "runs" / "1-seed-2"
    assert f"nlosimrerun{directory}" in "".join(card(tab).split())
    tab.evaluate(f"{PAGE}.select(2)")
    assert "not kept" in card(tab)
    assert "nlosim rerun" not in card(tab)


def test_a_failed_run_is_marked_and_says_why(tab: Tab) -> None:
    rows = tab.evaluate(
        "Array.from(document.querySelectorAll('.runs tr.failed'), (e) => e.innerText)"
    )
    assert len(rows) == 1
    assert f"✗ failed: `car`: broke at 1 s {EVIL}".replace("\u2028", " ") in rows[0].replace(
        "\u2028", " "
    )
    assert "✗ 1 run failed" in tab.evaluate("document.getElementById('head').innerText")
    assert "broke at 1 s" in tab.evaluate("document.getElementById('failed').innerText")
    failed = tab.evaluate(f"{PAGE}.show({{ x: -1 }}), {PAGE}.charts.spread.svg()")
    assert failed.count("✗ 1 failed") == 1


def test_arrows_go_through_the_runs_of_the_filtered_table(tab: Tab) -> None:
    tab.press("/", "Slash", "/")
    assert tab.evaluate("document.activeElement.id") == "filter"
    tab.evaluate(
        f"{PAGE}.filter.value = 'seed=3 hit=false';"
        f"{PAGE}.filter.dispatchEvent(new Event('input'));"
        "document.activeElement.blur()"
    )
    shown = tab.evaluate(f"{PAGE}.ordered()")
    assert shown == [2, 10, 14]
    for run in (2, 10, 14, 14):
        tab.press("ArrowRight")
        assert tab.evaluate(f"{PAGE}.chosen") == run
    tab.press("Escape")
    assert tab.evaluate("document.querySelector('.run-card').hidden") is True


def test_a_heading_sorts_and_sorts_back(tab: Tab) -> None:
    click = "document.querySelectorAll('.runs th button')[3].click()"
    values = f"{PAGE}.ordered().map((run) => {PAGE}.results.value(run, {PAGE}.results.metrics[0]))"
    tab.evaluate(click)
    up = tab.evaluate(values)
    tab.evaluate(click)
    down = tab.evaluate(values)
    assert up[-1] is down[-1] is None
    assert up[:-1] == sorted(up[:-1]) == down[-2::-1]
    assert (
        tab.evaluate("document.querySelector('[aria-sort]').getAttribute('aria-sort')")
        == "descending"
    )


@pytest.mark.parametrize("metric", [0, 1])
@pytest.mark.parametrize("chart", ["means", "spread", "pairs"])
def test_every_figure_is_a_picture_that_stands_alone_and_a_table(
    tab: Tab, chart: str, metric: int
) -> None:
    """Well-formed SVG without classes, scripts and links; CSV of rows of one length."""
    tab.evaluate(f"{PAGE}.show({{ metric: {metric} }})")
    root = ET.fromstring(tab.evaluate(f"{PAGE}.charts.{chart}.svg()").encode())  # noqa: S314 - ours
    assert root.tag == f"{SVG}svg"
    every = list(root.iter())
    assert len(every) > 15
    assert not any({"class", "style", "href"} & set(each.attrib) for each in every)
    numbers = "".join(each.attrib.get("d", "") for each in every)
    assert "NaN" not in numbers
    rows = list(csv.reader(io.StringIO(tab.evaluate(f"{PAGE}.charts.{chart}.csv()"), newline="")))
    assert len({len(row) for row in rows}) == 1
    assert len(rows) == {"means": 5, "spread": 17, "pairs": 3}[chart]


@pytest.mark.parametrize(("chart", "metric"), [("means", 0), ("spread", 0), ("pairs", 1)])
def test_marks_are_where_their_values_are(tab: Tab, chart: str, metric: int) -> None:
    """Places are linear in the values: upwards on the page, for differences to the right."""
    tab.evaluate(f"{PAGE}.show({{ metric: {metric}, factor: 1 }})")
    axis, sign = ("x", 1) if chart == "pairs" else ("y", -1)
    found = tab.evaluate(f"{PAGE}.charts.{chart}.points.map((each) => [each.value, each.{axis}])")
    values, places = np.array(found, np.float64).T
    slope, start = np.polyfit(values, places, deg=1)
    assert np.sign(slope) == sign
    np.testing.assert_allclose(slope * values + start, places, atol=0.05)
    assert len(set(values.tolist())) > 2


def test_the_files_are_offered_under_names_that_any_system_takes(tab: Tab) -> None:
    tab.evaluate(
        "window.saved = []; HTMLAnchorElement.prototype.click = function () {"
        "window.saved.push([this.download, this.href.slice(0, 5)]); };"
        "document.querySelectorAll('#means .tool, #runs .tool').forEach((each) => each.click())"
    )
    names = [["street-means-prr.svg", "blob:"], ["street-means-prr.csv", "blob:"]]
    assert tab.evaluate("window.saved") == [*names, ["street-runs.csv", "blob:"]]


def test_the_view_is_kept_in_the_address(tab: Tab, page: Path) -> None:
    tab.press("m", "KeyM", "m")
    tab.press("x", "KeyX", "x")
    fragment = tab.evaluate("location.hash")
    view = tab.evaluate(f"{PAGE}.view")
    assert (view["metric"], view["x"]) == (1, -1)
    tab.call("Page.navigate", url="about:blank")
    tab.open(page, fragment=fragment)
    assert tab.evaluate(f"{PAGE}.view") == view


@pytest.mark.parametrize("width", [390, 320])
def test_nothing_is_wider_than_a_phone(tab: Tab, width: int) -> None:
    tab.resize(width, 800, scale=2, mobile=True)
    tab.frames(3)
    tab.evaluate(f"{PAGE}.select(1)")
    tab.frames(3)
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    assert (
        tab.evaluate(f"{PAGE}.charts.means.whole.querySelector('svg').viewBox.baseVal.width")
        < width
    )


def test_paper_has_figures_and_rows_but_no_controls(tab: Tab) -> None:
    tab.call("Emulation.setEmulatedMedia", media="print")
    seen = "(selector) => document.querySelector(selector).getClientRects().length > 0"
    found = [
        tab.evaluate(f"({seen})('{s}')") for s in ("#means svg", ".runs td", ".controls", "#filter")
    ]
    tab.call("Emulation.setEmulatedMedia", media="")
    assert found == [True, True, False, False]
