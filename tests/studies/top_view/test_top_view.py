"""The top view of a run of the red light: what is on the page is what was recorded."""

import base64
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from fmus.messages.records import OUTCOMES, PACKET, RECEPTION
from orchestrator.cli import main
from orchestrator.page.layer import PageOfRun
from orchestrator.page.page import make_page
from orchestrator.recording import Recording
from studies.measures.radio import table_of
from studies.top_view import TopView
from studies.top_view.crowd import crowd_of
from studies.top_view.radio import radio_of
from studies.top_view.sensing import every
from studies.top_view.signals import sources_of

pytestmark = pytest.mark.slow

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The half second in which the first sensor data are sent."""
    out = tmp_path_factory.mktemp("red_light") / "run"
    sets = ["--set", "time.stop=7.5 s", "--set", "measures={}", "--set", "report=null"]
    sets += ["--set", "recording.exclude=[]"]
    arguments = ["run", str(SCENARIO), *sets, "--no-page", "--quiet", "--json", "--out", str(out)]
    assert main(arguments) == 0
    return out


def page_of(run: Path) -> PageOfRun:
    recording = Recording(run)
    stop = recording.manifest["reached_ns"]
    return PageOfRun(recording=recording, manifest=recording.manifest, start=0, stop=stop)


def kept(page: PageOfRun, reference: Any) -> Any:
    """An array of the page, as the scripts read it, but in NumPy."""
    data = zlib.decompress(base64.b64decode(page.arrays.letters()), -15)
    if "step" in reference:
        whole = kept(page, reference["whole"]).astype(float)
        return np.where(whole == -32768, np.nan, whole * reference["step"] + reference["middle"])
    if "unit" in reference:
        return kept(page, reference["whole"]) * reference["unit"]
    dtype = np.dtype(f"<{reference['type']}")
    size = reference["n"] * dtype.itemsize
    planes = np.frombuffer(data, np.uint8, size, reference["at"]).reshape(dtype.itemsize, -1)
    found = planes.T.copy().view(dtype)[:, 0]
    for _ in range(reference["deltas"]):
        found = np.cumsum(found, dtype=dtype)
    return found


def test_signals_are_found_by_what_they_are(run: Path) -> None:
    sources = sources_of(Recording(run))
    assert sources is not None
    assert sources.traffic == "traffic"
    assert sources.egos == {"traffic.ego.id": "ego"}
    assert sources.packets == "facilities.packets"
    assert sources.receptions == "channel.receptions"
    assert sources.objects == ("perception.objects", "facilities.received.objects")
    assert sources.points == ("lidar.points",)
    assert sources.relays == ("relay.relay",)


def test_everybody_is_within_a_centimetre_of_where_they_were(run: Path) -> None:
    page = page_of(run)
    crowd = crowd_of(page, "traffic")
    x, y = kept(page, crowd.data["x"]), kept(page, crowd.data["y"])
    owner, first, count = (
        kept(page, crowd.data["stretches"][name]) for name in ("vehicle", "first", "count")
    )
    begins = np.cumsum(count) - count
    series = page.recording["traffic.vehicle.id"]
    for k in (0, 77, len(series) - 1):
        ids = np.asarray(series[k])
        place = np.asarray(page.recording["traffic.vehicle.position"][k])
        here = np.flatnonzero((first <= k) & (k < first + count))
        rows = begins[here] + k - first[here]
        assert sorted(crowd.ids[owner[here]]) == sorted(ids)
        order = np.argsort(crowd.ids[owner[here]])
        wanted = place[np.argsort(ids)]
        assert np.abs(x[rows][order] - wanted[:, 0]).max() <= 0.0051
        assert np.abs(y[rows][order] - wanted[:, 1]).max() <= 0.0051


def test_entities_have_their_names(run: Path) -> None:
    crowd = crowd_of(page_of(run), "traffic")
    assert crowd.names[:4] == ("ego", "collider", "sharer", "blocking.0")


def test_the_fate_of_every_packet_is_counted(run: Path) -> None:
    """Of packets to all, receptions of all; of those to one, those of the addressee."""
    page = page_of(run)
    sources = sources_of(page.recording)
    assert sources is not None
    data, _ = radio_of(page, sources, crowd_of(page, "traffic"))
    assert data is not None
    assert data["stride"] == 1
    packets = table_of(page.recording, sources.packets, "PKTS", PACKET).records
    records = table_of(page.recording, sources.receptions, "RCPT", RECEPTION).records
    ids = kept(page, data["packets"]["id"]) + data["packets"]["first"]
    assert sorted(ids) == sorted(set(packets["id"].tolist()))
    fates = kept(page, data["packets"]["fates"]).reshape(len(OUTCOMES), -1)
    counts = records[records["addressed"] == 1]
    for row in (0, len(ids) // 2, int(np.flatnonzero(kept(page, data["packets"]["kind"]) == 2)[0])):
        of_it = counts[counts["packet"] == ids[row]]
        expected = np.bincount(of_it["outcome"], minlength=len(OUTCOMES))
        assert fates[:, row].tolist() == expected.tolist()


def test_all_that_the_ego_hears_is_on_the_page(run: Path) -> None:
    page = page_of(run)
    sources = sources_of(page.recording)
    assert sources is not None
    crowd = crowd_of(page, "traffic")
    data, _ = radio_of(page, sources, crowd)
    assert data is not None
    records = table_of(page.recording, sources.receptions, "RCPT", RECEPTION).records
    ego = records[records["receiver"] == 0]
    heard = data["heard"]
    place = heard["receivers"].index(int(crowd.index(np.array([0]))[0]))
    end = heard["ends"][place]
    begin = heard["ends"][place - 1] if place else 0
    assert end - begin == len(ego)
    order = np.lexsort((ego["hop"], ego["packet"]))
    power = kept(page, heard["power"])[begin:end]
    assert np.abs(power - ego["power_dbm"][order]).max() <= 0.0501
    assert (kept(page, heard["code"])[begin:end] & 7).tolist() == ego["outcome"][order].tolist()


def test_points_are_where_the_lidar_saw_bodies_and_walls(run: Path) -> None:
    """At most 50 m from their sensor, fewer than were recorded, none of them on the ground."""
    page = page_of(run)
    content = TopView().content(page)
    assert content is not None
    (points,) = content.data["sensing"]["points"]
    x = kept(page, points["x"])
    assert 1000 < len(x) <= 130_000
    building = kept(page, points["building"])
    assert 0 < building.mean() < 1


@pytest.mark.parametrize(
    ("count", "most", "expected"), [(0, 5, 1), (5, 5, 1), (6, 5, 2), (11, 5, 3)]
)
def test_no_more_is_kept_than_there_is_room_for(count: int, most: int, expected: int) -> None:
    assert every(count, most) == expected


def test_the_page_says_who_everybody_is_and_is_the_same_every_time(run: Path) -> None:
    first = make_page(run).read_bytes()
    assert make_page(run).read_bytes() == first
    found = re.search(rb'id="data">(.*?)</script>', first)
    assert found is not None
    data = json.loads(found[1])
    assert list(data["layers"]["top-view"]["entities"]) == ["ego", "collider", "sharer", "blocking"]
    assert data["left_out"] == {}
    assert data["shown"][:2] == ["traffic.ego.speed", "traffic.ego.gap"]
    assert len(first) < 1_500_000


def test_a_layer_that_fails_is_left_out_and_the_page_says_so(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_: TopView, __: PageOfRun) -> None:
        raise ZeroDivisionError("no vehicles")

    monkeypatch.setattr(TopView, "content", fails)
    text = make_page(run).read_text()
    assert "ZeroDivisionError: no vehicles" in text
    assert "Wiring" in text
