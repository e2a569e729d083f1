"""Parameters of the radios, common to all link models; names and units are the channel FMU's."""

from dataclasses import dataclass

from fmus.channel.caution import UNNOTICED
from fmus.channel.stand_ins.airtime import BITS_PER_SYMBOL
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.timebase import nanoseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioParameters:
    """How long frames take; who receives them is the link model's business."""

    bitrate: float = parameter(
        6e6,
        unit="bit/s",
        minimum=3e6,
        maximum=27e6,
        doc="of the payload: 3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6 or 27e6",
    )
    mac_header: int = parameter(
        38, minimum=0, maximum=1000, doc="bytes that MAC and LLC add to a packet"
    )
    latency: float = parameter(
        0.0, unit="s", minimum=0.0, maximum=1e3, doc="added to the time on air, for each hop"
    )
    relay_delay: float = parameter(
        2e-4, unit="s", minimum=0.0, maximum=1e3, doc="from a reception at a relay to its next hop"
    )
    busy_window: float = parameter(
        0.1, unit="s", minimum=1e-3, maximum=1e3, doc="over which the busy ratio is measured"
    )
    weak_receptions: bool = parameter(
        default=True,
        doc="report also the radios that did not notice a frame (outcome U)",
        caution=UNNOTICED,
    )
    seed: int | None = parameter(
        None,
        minimum=0,
        maximum=2**64 - 1,
        doc="of the draws; null: drawn from the component's random stream",
    )


def refuse(parameters: RadioParameters) -> None:
    """Refuse values that no bound expresses.

    Raises:
        ComponentTypeError: all that is wrong, one sentence each.
    """
    problems = []
    if parameters.bitrate not in BITS_PER_SYMBOL:
        rates = ", ".join(f"{rate / 1e6:g}" for rate in BITS_PER_SYMBOL)
        problems.append(
            f"`bitrate` is {parameters.bitrate / 1e6:g} Mbit/s; 802.11p has {rates} Mbit/s"
        )
    for name in ("latency", "relay_delay", "busy_window"):
        try:
            nanoseconds(getattr(parameters, name))
        except ValueError as error:
            problems.append(f"`{name}`: {error}")
    if problems:
        raise ComponentTypeError("\n".join(problems))
