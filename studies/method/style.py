"""How methods look in the figures of studies; all else is in `orchestrator.drawing`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from orchestrator.intervals import Estimate
from orchestrator.palette import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION


@dataclass(frozen=True, slots=True)
class Look:
    """How one method is drawn.

    Attributes:
        name: what legends call it.
        colour: of Okabe and Ito's palette, which readers with colour blindness can tell apart.
        marker: different for every method, for readers without colours.
    """

    name: str
    colour: str
    marker: str


LOOKS: Final[Mapping[str, Look]] = {
    "mohed": Look("MoHeD", BLUE, "o"),
    "signal-strength": Look("signal strength, sum", VERMILLION, "s"),
    "signal-strength-min": Look("signal strength, weaker hop", ORANGE, "D"),
    "signal-strength-own": Look("signal strength, own hop", "#7A4A2B", "p"),
    "signal-strength-rel18": Look("signal strength, Release 18", "#4D4D4D", "d"),
    "random": Look("random", GREEN, "^"),
    "direct": Look("direct link", PURPLE, "v"),
    "expected-prr": Look("expected PRR", SKY, "P"),
    "oracle": Look("oracle", BLACK, "*"),
    "fair-oracle": Look("fair oracle", "#666666", "X"),
    "mohed-trajectories": Look("MoHeD, trajectories", "#5E3C99", "h"),
    "mohed-trajectories-ties": Look("MoHeD, trajectories, ties not kept", "#8A6D3B", "<"),
}
_OTHERS: Final = (("#666666", "X"), ("#8A6D3B", "<"), ("#9A9A00", ">"), ("#5E3C99", "h"))


def looks(methods: list[str]) -> dict[str, Look]:
    """The look of every method; those that we do not know get what is left."""
    others = iter(_OTHERS * len(methods))
    return {m: LOOKS[m] if m in LOOKS else Look(m, *next(others)) for m in methods}


def method_name(method: str) -> str:
    """What readers call a method."""
    return LOOKS[method].name if method in LOOKS else method


def bars(found: Sequence[Estimate]) -> list[list[float]]:
    """Lengths of the error bars of shares, below and above [%]; none where there is no interval."""
    below = [0.0 if one.low is None else 100 * max(0.0, one.value - one.low) for one in found]
    above = [0.0 if one.high is None else 100 * max(0.0, one.high - one.value) for one in found]
    return [below, above]
