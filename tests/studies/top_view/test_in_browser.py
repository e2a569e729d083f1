"""The page as a person would use it, in a headless browser, where there is one."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import scenarios
from orchestrator.cli import main
from tests.browser import Tab, browser

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
VIEW = "NLOSIM.page.view"
CLOCK = "NLOSIM.page.clock"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The red light until sensor data come by relays."""
    out = tmp_path_factory.mktemp("run") / "run"
    sets = ["--set", "time.stop=8 s", "--set", "measures={}", "--set", "report=null"]
    assert main(["run", str(SCENARIO), *sets, "--quiet", "--json", "--out", str(out)]) == 0
    return out / "index.html"


@pytest.fixture(scope="module")
def opened(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        tab.open(page)
        yield tab


@pytest.fixture
def tab(opened: Tab) -> Iterator[Tab]:
    """The page at its start, unselected; nothing may be said on the console."""
    opened.resize(1280, 900)
    opened.evaluate(f"{CLOCK}.play(false); {CLOCK}.speed = 1; {VIEW}.select(-1); scrollTo(0, 0)")
    yield opened
    assert opened.errors == []


def at(tab: Tab, time: float) -> None:
    tab.evaluate(f"{CLOCK}.seek({time})")
    tab.frames(3)


def test_nothing_is_asked_for_from_elsewhere(tab: Tab, page: Path) -> None:
    assert tab.requests == [page.as_uri()]


def test_it_says_how_to_repeat_the_run_and_compare(tab: Tab, page: Path) -> None:
    said = tab.evaluate("document.getElementById('manifest').textContent")
    assert f"nlosim rerun {page.parent}" in said


def test_an_old_browser_unpacks_the_same_bytes(tab: Tab) -> None:
    """What `DecompressionStream` makes is what our own inflate makes."""
    same = tab.evaluate(
        """(async () => {
          const bytes = NLOSIM.page.arrays.bytes;
          const packed = new Uint8Array(await new Response(new Blob([bytes]).stream()
            .pipeThrough(new CompressionStream('deflate-raw'))).arrayBuffer());
          const again = NLOSIM.inflate(packed);
          return again.length === bytes.length && again.every((byte, k) => byte === bytes[k]);
        })()"""
    )
    assert same is True


def test_space_plays_and_pauses_and_arrows_step(tab: Tab) -> None:
    at(tab, 1.0)
    tab.press(" ", "Space", " ")
    tab.wait(f"{CLOCK}.time > 1.05")
    tab.press(" ", "Space", " ")
    assert tab.evaluate(f"{CLOCK}.playing") is False
    at(tab, 1.0)
    tab.press("ArrowRight")
    after = tab.evaluate(f"{CLOCK}.time")
    tab.press("ArrowLeft")
    assert after > 1.0
    assert tab.evaluate(f"{CLOCK}.time") == pytest.approx(1.0)
    tab.press("End")
    assert tab.evaluate(f"{CLOCK}.time") == 8.0


def test_speed_and_help_have_keys(tab: Tab) -> None:
    tab.press(".", "Period", ".")
    assert tab.evaluate(f"{CLOCK}.speed") == 2
    tab.press(",", "Comma", ",")
    assert tab.evaluate(f"{CLOCK}.speed") == 1
    tab.press("?", "Slash", "?")
    assert tab.evaluate("document.querySelector('dialog').open") is True
    tab.press("Escape")
    tab.evaluate("document.querySelector('dialog').close()")


def test_a_click_on_a_vehicle_tells_what_it_is_and_what_it_knows(tab: Tab) -> None:
    at(tab, 7.0)
    x, y = tab.evaluate(
        f"(() => {{ const v = {VIEW}; const now = v.crowd.at(7); const n = now.row[0];"
        "const box = document.querySelector('.moving').getBoundingClientRect();"
        "const [x, y] = v.camera.toScreen(now.x[n], now.y[n]);"
        "return [box.left + x, box.top + y]; })()"
    )
    tab.click(x, y)
    assert tab.evaluate(f"{VIEW}.selected") == 0
    said = tab.evaluate("document.querySelector('.card-of').innerText")
    assert said.startswith("ego (0)")
    assert "km/h" in said
    assert "road users within 60 m" in said


def test_a_packet_tells_its_hops_and_its_fate(tab: Tab) -> None:
    at(tab, 7.9)
    packet = tab.evaluate(
        f"{VIEW}.radio.recent({VIEW}.observer, 7.9, 9, false)"
        f".find((p) => {VIEW}.radio.packets.kind[p] === 2)"
    )
    tab.evaluate(f"{VIEW}.showPacket({packet})")
    tab.frames(3)
    said = tab.evaluate("document.querySelector('.card-of').innerText")
    assert said.startswith("sensor data ")
    assert "dBm" in said
    assert "handed to the radio at" in said


def test_the_cursor_of_the_charts_is_that_of_the_picture(tab: Tab) -> None:
    tab.evaluate("document.querySelector('.chart').scrollIntoView()")
    at(tab, 4.0)
    share, said = tab.evaluate(
        "(() => { const over = document.querySelector('.u-over').getBoundingClientRect();"
        "const now = document.querySelector('.now').getBoundingClientRect();"
        "return [(now.left + now.width / 2 - over.left) / over.width,"
        "document.querySelector('#player output').textContent]; })()"
    )
    assert share == pytest.approx(0.5, abs=0.01)
    assert said == "4.000 s"


def test_any_signal_can_be_picked_by_its_name(tab: Tab) -> None:
    before = tab.evaluate("document.querySelectorAll('.legend b').length")
    tab.evaluate(
        "(() => { const pick = document.getElementById('pick');"
        "pick.value = 'relay.switches'; pick.dispatchEvent(new Event('change')); })()"
    )
    tab.frames(2)
    assert tab.evaluate("document.querySelectorAll('.legend b').length") == before + 1
    assert "relay.switches" in tab.evaluate("document.getElementById('timelines').innerText")


def test_the_picture_is_not_empty_and_moves(tab: Tab) -> None:
    """Many colours, and others after a second."""
    pixels = (
        "(() => { const from = document.querySelector('.moving');"
        "const c = Object.assign(document.createElement('canvas'), { width: from.width,"
        " height: from.height }); const context = c.getContext('2d', { willReadFrequently: true });"
        "context.drawImage(from, 0, 0);"
        "const d = context.getImageData(0, 0, c.width, c.height).data;"
        "const colours = new Set(); let sum = 0; for (let k = 0; k < d.length; k += 4) {"
        " const colour = (d[k] << 16) | (d[k + 1] << 8) | d[k + 2]; colours.add(colour);"
        " sum = (sum * 31 + colour) % 1000003; } return [colours.size, sum]; })()"
    )
    at(tab, 5.0)
    first = tab.evaluate(pixels)
    at(tab, 6.0)
    assert first[0] > 100
    assert tab.evaluate(pixels)[1] != first[1]


@pytest.mark.parametrize("width", [360, 390, 768])
def test_nothing_is_wider_than_a_phone(tab: Tab, width: int) -> None:
    tab.resize(width, 780, mobile=True)
    tab.frames(4)
    assert tab.evaluate("document.documentElement.scrollWidth") == width
    assert tab.evaluate("document.querySelector('.stage').clientWidth") > 0.85 * width


def test_paper_has_no_buttons(tab: Tab) -> None:
    tab.call("Emulation.setEmulatedMedia", media="print")
    shown = tab.evaluate(
        "Array.from(document.querySelectorAll('button, #player')).filter((each) =>"
        " each.getClientRects().length).length"
    )
    tab.call("Emulation.setEmulatedMedia", media="")
    assert shown == 0


def test_a_run_without_vehicles_is_shown_too(tmp_path: Path) -> None:
    """Names that look like tags stay names."""
    scenario = tmp_path / "heat.yaml"
    (tmp_path / "table.csv").write_text("time,heat [W]\n0,1\n1,5\n2,2\n")
    scenario.write_text(
        'schema: 1\ntitle: "</script><img src=x onerror=alert(1)>"\n'
        "time: {stop: 2 s}\ncomponents:\n  plant:\n    type: table-source\n    step: 100 ms\n"
        "    parameters: {file: table.csv}\nconnections: []\n"
    )
    out = tmp_path / "run"
    assert main(["run", str(scenario), "--quiet", "--json", "--out", str(out)]) == 0
    with browser(tmp_path / "browser") as tab:
        tab.open(out / "index.html")
        title = tab.evaluate("document.querySelector('h1').textContent")
        assert title == "</script><img src=x onerror=alert(1)>"
        assert tab.evaluate("document.images.length") == 0
        assert tab.evaluate("document.querySelectorAll('.chart').length") == 1
        assert tab.evaluate("document.getElementById('top-view')") is None
        assert tab.errors == []
