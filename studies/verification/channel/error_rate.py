"""`nist_error_rate.csv`: probabilities that parts of a frame are decoded, at given SNIR.

The channel is asked through links whose length makes the wanted SNIR in free space. A link gives
the probabilities of the header and of the payload, which has 16 + n + 6 bits for n bits of the
packet; for bits that are independent, those of n bits alone follow exactly, as the power n / (n +
22) of the latter.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from fmus.physics.propagation import SPEED_OF_LIGHT
from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.table import Table, number, read_table, whole
from studies.verification.channel.tolerances import PROBABILITY, Tolerance

NAME: Final = "nist_error_rate.csv"
BITRATES: Final = (3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6, 27e6)
_COLUMNS: Final = ("chunk_success", "header_success", "payload_success", "packet_success")
_SERVICE_AND_TAIL: Final = 22  # bits, IEEE 802.11-2020, 17.3.2
_CARRIER: Final = 5.9e9
_POWER: Final = 26.0
_NOISE: Final = -98.0
_LOSS_AT_1_M: Final = 20 * np.log10(4 * np.pi * _CARRIER / SPEED_OF_LIGHT)


def success(
    channel: ChannelUnderTest, snir_db: Array, size: Array, bitrate: float
) -> tuple[Array, Array]:
    """Probabilities that the channel spares the header and the payload of frames.

    Args:
        channel: the channel.
        snir_db: shape (n,).
        size: of the packets [byte], shape (n,).
        bitrate: [bit/s].
    """
    parameters: dict[str, Any] = {
        "carrier_frequency": _CARRIER,
        "transmit_power": _POWER,
        "noise_floor": _NOISE,
        "bitrate": bitrate,
        "mac_header": 0,
        "band_edges": False,  # the SNIR is wanted exactly, at one frequency
    }
    distance = 10 ** ((_POWER - _NOISE - _LOSS_AT_1_M - snir_db) / 20)
    receiver = np.zeros((len(distance), 3))
    receiver[:, 0] = distance
    probes = scene.links(np.zeros_like(receiver), receiver, size=size)
    with channel.start(parameters, probes) as session:
        return session.probed("header_success"), session.probed("payload_success")


@dataclass(frozen=True, slots=True)
class ErrorRateCheck(Check):
    """The frames of the file."""

    table: Table

    @property
    @override
    def tolerance(self) -> Tolerance:
        return PROBABILITY

    @property
    @override
    def work(self) -> int:
        return len(np.unique(self.table["bitrate_bps"]))

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        places, series = [], []
        for bitrate in np.unique(self.table["bitrate_bps"]):
            rows = np.flatnonzero(self.table["bitrate_bps"] == bitrate)
            snir, bits = self.table["snr_db"][rows], self.table["mpdu_bits"][rows]
            header, payload = success(channel, snir, bits // 8, float(bitrate))
            chunk = payload ** (bits / (bits + _SERVICE_AND_TAIL))
            ours = dict(zip(_COLUMNS, (chunk, header, payload, header * payload), strict=True))
            for column in _COLUMNS:
                places += [f"{NAME}:{row + 2}: {column}" for row in rows]
                series.append(
                    Series(
                        label=f"{bitrate / 1e6:g} Mbit/s, {column}",
                        golden=self.table[column][rows],
                        ours=ours[column],
                        x=snir,
                    )
                )
            progress.advance()
        return Comparison.of_values(PROBABILITY, places, series)


def read(path: Path) -> ErrorRateCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    numbers = dict.fromkeys(("bitrate_bps", "snr_db", *_COLUMNS), number)
    table = read_table(path, NAME, {**numbers, "mpdu_bits": whole})
    _refuse(table, ~np.isin(table["bitrate_bps"], BITRATES), "bitrate_bps: no rate of 10 MHz")
    bits = table["mpdu_bits"]
    _refuse(table, (bits <= 0) | (bits % 8 != 0), "mpdu_bits: must be a multiple of 8 above 0")
    return ErrorRateCheck(table)


def _refuse(table: Table, is_wrong: Array, what: str) -> None:
    if is_wrong.any():
        raise table.problem(int(np.flatnonzero(is_wrong)[0]), what)
