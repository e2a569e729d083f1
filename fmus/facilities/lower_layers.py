"""What the layers under the facilities add to a message, in bytes.

The channel adds the headers of LLC and MAC itself. Everything here is arithmetic on the field
sizes in the standards; nothing is signed.
"""

from dataclasses import dataclass
from typing import Final

BTP: Final = 4
"""BTP-B: destination port and its information, 2 bytes each (ETSI TS 103 836-5-1, 7.2.2)."""

GEONETWORKING: Final = 40
"""Single-hop broadcast: basic header 4, common header 8, long position vector of the source 24,
media-dependent data 4 (ETSI EN 302 636-4-1, 9.6, 9.7 and 9.8.4)."""

_ENVELOPE: Final = 84
"""Signed data of IEEE 1609.2 in canonical octet encoding, without signer and the length of what is
signed: version and content 2, hash algorithm 1, presence of payload parts 1, version and content of
the payload 2, header information 12 (presence 1, ITS-AID of CPMs 3, generation time 8), signature
66 (ECDSA P-256: two choices, r 32, s 32)."""
_DIGEST: Final = 9
"""The signer as the last 8 bytes of its certificate's hash, and the choice."""
_CERTIFICATES: Final = 3
"""What stands before a certificate: the choice, and how many follow, 2 bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LowerLayers:
    """The headers of one station's messages.

    Attributes:
        signed: whether messages are signed (ETSI TS 103 097).
        certificate_size: of the station's authorisation ticket [byte].
    """

    signed: bool
    certificate_size: int

    def size(self, payload: int, *, certificate: bool) -> int:
        """Bytes of a packet with a message of `payload` bytes, as handed to the radio.

        Args:
            payload: of the facilities layer [byte].
            certificate: the signer is given by its certificate, not by its digest.
        """
        plain = GEONETWORKING + BTP + payload
        if not self.signed:
            return plain
        signer = _CERTIFICATES + self.certificate_size if certificate else _DIGEST
        protected = plain - 4  # the basic header stays outside
        return plain + _ENVELOPE + signer + _length(protected)


def _length(size: int) -> int:
    """Bytes of a length field (ITU-T X.696, 8.6)."""
    return 1 if size < 128 else 1 + (size.bit_length() + 7) // 8
