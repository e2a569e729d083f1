"""What it means for a channel that nothing drives an input; of its forms, where they agree."""

from typing import Final

from orchestrator.absence import Need, Undriven

VEHICLES: Final = Undriven("there are no radios, and nothing is sent or received")
PACKETS: Final = Undriven("nothing is sent, and nothing is received")
NO_BUILDINGS: Final = Undriven("there are no buildings, and none shadows a link", Need.IF_OFFERED)
UNUSED_BUILDINGS: Final = Undriven("no matter: this channel knows no buildings", Need.NEVER)

_PROBES: Final = ("probe.transmitter", "probe.receiver")
PROBES: Final = Undriven("no link is probed", Need.NEVER, frozenset(_PROBES))
PROBE_CARRIERS: Final = Undriven("nobody carries the antennas of a probed link", Need.NEVER)
PROBE_SIZES: Final = Undriven("packets of probed links have 200 bytes", Need.NEVER)
