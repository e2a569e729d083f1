"""Data frames and datasets: every number is at its time and its element, with its unit."""

import sys
from pathlib import Path

import numpy as np
import pytest

from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording
from tests.orchestrator.cars import CARS, SAMPLES
from tests.recordings import record

pytest.importorskip("pandas")
xarray = pytest.importorskip("xarray")


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return record(tmp_path / "run", CARS, SAMPLES, step=1)


def test_a_frame_has_a_row_for_each_time_and_element(recording: Recording) -> None:
    frame = recording.frame("source.car.place", "source.car.far")
    assert list(frame.columns) == ["time", "car", "car.far", "car.place[0]", "car.place[1]"]
    assert len(frame) == sum(len(np.asarray(each["car.id"])) for each in SAMPLES)
    told = frame[frame["time"] == 5e-9].set_index("car")
    assert told.index.tolist() == [15, 25]
    assert told.loc[25, "car.place[1]"] == 503.0
    assert frame.attrs["units"]["car.place[0]"] == "m"
    assert frame.attrs["units"]["time"] == "s"
    assert frame["car.far"].dtype == bool
    assert (frame["time"] * 1e9).round().astype(int).unique().tolist() == [1, 2, 4, 5]


def test_a_dataset_has_the_axes_of_the_signal(recording: Recording) -> None:
    found = recording.dataset("source.car.place")
    place = found["car.place"]
    assert place.dims == ("time", "car", "car.place_0")
    assert place.attrs == {"units": "m"}
    assert found["time"].attrs == {"units": "s"}
    assert found["time"].values.tolist() == [k / 1e9 for k in range(7)]  # 0, 3 and 6 have no car
    assert found["car"].values.tolist() == [11, 12, 14, 15, 22, 25]
    for k, sample in enumerate(SAMPLES):
        ids = np.asarray(sample["car.id"])
        assert np.array_equal(place.isel(time=k).sel(car=ids).values, sample["car.place"])
    assert int(place.notnull().sum()) == 2 * sum(len(np.asarray(s["car.id"])) for s in SAMPLES)


def test_arrays_of_constant_shape_keep_it_and_their_type(recording: Recording) -> None:
    field = recording.dataset("source.field")["field"]
    assert field.dims == ("time", "index_0", "index_1")
    assert np.array_equal(field.values, np.stack([np.asarray(s["field"]) for s in SAMPLES]))
    gains = recording.dataset("source.gains", "source.word")
    assert gains["gains"].dims == ("time", "gains_0")
    assert np.array_equal(
        gains["gains"].values, np.stack([np.asarray(s["gains"]) for s in SAMPLES])
    )
    assert gains["word"].values.tolist() == [f"wörd {k}" for k in range(7)]
    pair = recording.dataset("source.pair")["pair"]
    assert pair.dims == ("time", "car_index", "radio_index")
    assert pair.dtype == np.float32
    assert np.isnan(pair.values[0]).all()


def test_records_have_a_row_each(tmp_path: Path) -> None:
    from fmus.messages.records import PACKET, PACKETS_MIME, frame  # noqa: PLC0415 - of a unit
    from tests.recordings import output  # noqa: PLC0415 - beside it

    packets = np.zeros(3, PACKET)
    packets["id"], packets["time"], packets["size"] = [4, 5, 6], [10, 20, 30], [200, 300, 400]
    samples = [{"sent": frame("PKTS", packets)}, {"sent": b""}]
    connectors = {"sent": output(dtype=None, mime_type=PACKETS_MIME)}
    recording = record(tmp_path / "run", connectors, samples, component="radio", step=100)
    told = recording.frame("radio.sent")
    assert told["packet"].tolist() == [4, 5, 6]
    assert told["handed_over"].tolist() == [1e-8, 2e-8, 3e-8]
    assert told["kind"].tolist() == ["bsm"] * 3
    assert told.attrs["units"]["size"] == "byte"
    labelled = recording.dataset("radio.sent")
    assert labelled["size"].dims == ("record",)
    assert labelled["handed_over"].attrs == {"units": "s"}


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ([], "name a signal"),
        (["source.sped"], r"did you mean `source.speed`\?"),
        (["source.blob"], "`source.blob` is left out: binary"),
        (["source.speed", "source.car.far"], "along different axes, so ask for each by itself"),
    ],
)
def test_what_cannot_be_one_frame_is_said(
    signals: list[str], message: str, recording: Recording
) -> None:
    with pytest.raises(RecordingError, match=message):
        recording.frame(*signals)


@pytest.mark.parametrize("module", ["pandas", "xarray"])
def test_without_the_extra_it_is_said_what_to_install(
    module: str, recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    asked = recording.frame if module == "pandas" else recording.dataset
    with pytest.raises(RecordingError, match=rf"needs `{module}`.*pip install 'nlosim\[frames\]'"):
        asked("source.speed")


def test_what_is_lost_is_no_silent_gap(recording: Recording, tmp_path: Path) -> None:
    part = tmp_path / "run/signals/source/speed.zst"
    data = bytearray(part.read_bytes())
    data[data.index(b"\x28\xb5\x2f\xfd") + 8] ^= 255  # within the first frame of Zstandard
    part.write_bytes(data)
    with pytest.raises(RecordingError, match="damaged"):
        recording.frame("source.speed")
