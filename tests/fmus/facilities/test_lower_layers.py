"""Bytes under a message: sums of field sizes."""

import pytest

from fmus.facilities.lower_layers import LowerLayers

SIGNED = LowerLayers(signed=True, certificate_size=157)
PLAIN = LowerLayers(signed=False, certificate_size=157)


@pytest.mark.parametrize("payload", [0, 40, 83, 84, 211, 212, 1000])
@pytest.mark.parametrize("certificate", [False, True])
def test_an_unsigned_packet_has_geonetworking_and_btp_headers(
    payload: int, *, certificate: bool
) -> None:
    assert PLAIN.size(payload, certificate=certificate) == payload + 40 + 4


@pytest.mark.parametrize(
    ("payload", "envelope"),
    [(87, 94), (88, 95), (215, 95), (216, 96), (1200, 96)],  # the length field grows
)
def test_a_digest_costs_94_to_96_bytes(payload: int, envelope: int) -> None:
    assert SIGNED.size(payload, certificate=False) - PLAIN.size(payload, certificate=False) == (
        envelope
    )


@pytest.mark.parametrize("payload", [40, 200, 1200])
def test_a_certificate_replaces_the_digest(payload: int) -> None:
    difference = SIGNED.size(payload, certificate=True) - SIGNED.size(payload, certificate=False)
    assert difference == (1 + 2 + 157) - (1 + 8)
