"""Bytes on the air: every frame that was sent, on every hop, by kind."""

from pathlib import Path

import pytest

from fmus.messages.records import APM, FATES, REQUEST, SENSOR_DATA
from orchestrator.recording.reader import Recording
from studies.sharing.air import OnAir
from tests.studies.measures.world import Body, packet, record, transmission


def run(folder: Path) -> Recording:
    packets = [
        packet(1, 1, 0.1),
        packet(2, 1, 0.2, kind=APM, size=300),
        packet(3, 2, 0.3, kind=SENSOR_DATA, size=1000),
        packet(4, 1, 0.4, kind=REQUEST, size=112),
    ]
    sent = [transmission(1, 1, 0.11)]
    for number, kind, hop in ((2, APM, 0), (3, SENSOR_DATA, 0), (3, SENSOR_DATA, 1)):
        row = transmission(number, 1, 0.35 + 0.02 * hop)
        row["kind"], row["hop"] = kind, hop
        sent.append(row)
    dropped = transmission(4, 1, 0.45)
    dropped["kind"], dropped["fate"] = REQUEST, FATES.index("queue full")
    return record(
        folder,
        [Body(id=1, start=(0, 0)), Body(id=2, start=(30, 0))],
        2.0,
        packets=packets,
        transmissions=[*sent, dropped],
    )


def test_frames_count_on_every_hop_and_not_if_they_were_given_up(tmp_path: Path) -> None:
    found = OnAir().compute(run(tmp_path / "run"))
    assert found == {
        "bsm_kbyte_s": pytest.approx(0.1),
        "apm_kbyte_s": pytest.approx(0.15),
        "sensor_data_kbyte_s": pytest.approx(1.0),
        "request_kbyte_s": 0.0,
        "sharing_kbyte_s": pytest.approx(1.15),
        "given_up": 1,
    }


def test_a_frame_of_no_packet_is_refused(tmp_path: Path) -> None:
    wrong = record(
        tmp_path / "run", [Body(id=1, start=(0, 0))], 1.0, transmissions=[transmission(9, 1, 0.5)]
    )
    with pytest.raises(ValueError, match=r"`channel.transmissions` has packet 9, which nobody"):
        OnAir().compute(wrong)
