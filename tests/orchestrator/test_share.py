"""Parameters that are shares of a whole."""

from dataclasses import dataclass

from orchestrator.parameters import Parameter, declared
from orchestrator.share import share


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    lost: float = share(0.25, doc="of the packets")


def test_a_share_is_a_number_from_0_to_1_without_unit() -> None:
    wanted = Parameter(
        type=float, unit="1", default=0.25, minimum=0.0, maximum=1.0, doc="of the packets"
    )
    assert declared(Parameters) == {"lost": wanted}
