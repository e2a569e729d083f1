"""What it means for a lidar that nothing drives an input; the same for both of its forms."""

from typing import Final

from orchestrator.absence import Need, Undriven

UNDRIVEN: Final = {
    "vehicle": Undriven("no vehicle carries a lidar, and none is seen"),
    "building": Undriven("there are no buildings, and nothing is hidden by one", Need.IF_OFFERED),
}
