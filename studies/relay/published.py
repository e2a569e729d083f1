"""What "NLOS Dies Twice" publishes about relay policies."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Published:
    """A row of Table II.

    Attributes:
        prr: average packet reception rate, 0 to 1.
        relay_switches: average number of changes of the relay in a run.
    """

    prr: float
    relay_switches: float


TABLE_2: Final = {
    "mohed": Published(0.8798, 2.75),
    "signal-strength": Published(0.4659, 3.34),
    "random": Published(0.5148, 3.65),
    "direct": Published(0.3922, 0.0),
}
"""Table II by the name of the level of the factor `method`. The paper does not say over how many
runs and which densities it averaged. The curves of Figures 7 and 8 are published as pictures only.
"""

DIRECT_PER: Final = 0.6078
"""Packet error rate of the direct link (section "Results & Analysis")."""

CLAIMED_ADVANTAGE: Final = 0.25
"""What MoHeD has over both rivals, at least, in packet reception rate (ibidem)."""

RIVALS: Final = ("signal-strength", "random")
"""The paper's methods besides MoHeD that use a relay."""
