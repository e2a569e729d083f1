"""A channel that loses every frame with the same probability."""

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.channel.stand_ins.component import LinkModelComponent
from fmus.channel.stand_ins.delivery import (
    NOISE_LOSS,
    RECEIVED,
    UNNOTICED,
    Int,
    LinkModel,
    Receivers,
    Verdicts,
)
from fmus.channel.stand_ins.packets import Frame
from fmus.channel.stand_ins.parameters import RadioParameters
from fmus.channel.stand_ins.philox import reception_draws
from fmus.messages.records import LINKS
from fmus.physics.propagation import SPEED_OF_LIGHT, free_space_loss
from orchestrator.parameters import parameter
from orchestrator.share import share

_LOS: Final = LINKS.index("LOS")


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantPerParameters(RadioParameters):
    """The packet error rate and the range; powers are for display only."""

    per: float = share(
        0.1,
        doc="probability that a frame is lost at a receiver within the range",
    )
    range: float = parameter(
        300.0, unit="m", minimum=0.0, doc="radios farther away do not notice a frame"
    )
    carrier_frequency: float = parameter(
        5.9e9, unit="Hz", minimum=1e8, maximum=1e11, doc="for the power that is displayed"
    )
    transmit_power: float = parameter(
        26.0, unit="dBm", minimum=-100.0, maximum=100.0, doc="for the power that is displayed"
    )
    noise_floor: float = parameter(
        -98.0, unit="dBm", minimum=-200.0, maximum=0.0, doc="for the SNIR that is displayed"
    )


class ConstantPer(LinkModelComponent):
    """A channel that loses frames at a constant packet error rate, whatever stands in the way.

    Every receiver within `range` loses every frame independently with probability `per`. The
    default, 0.1, is the packet reception rate of 90 % that studies of cooperative driving
    assumed. There is no shadowing, no interference and no medium access.
    """

    Parameters: TypeAlias = ConstantPerParameters

    def __init__(self, parameters: ConstantPerParameters) -> None:
        super().__init__(parameters)
        self._parameters = parameters

    @override
    def link_model(self, seed: int) -> LinkModel:
        return _ConstantPerLinks(self._parameters, seed)


class _ConstantPerLinks(LinkModel):
    def __init__(self, parameters: ConstantPerParameters, seed: int) -> None:
        self._parameters = parameters
        self._seed = seed

    @override
    def judge(self, frame: Frame, receivers: Receivers, usual_delay: Int) -> Verdicts:
        given = self._parameters
        draws = reception_draws(self._seed, frame.packet, frame.hop, receivers.id)
        # one draw for every PER: what is received at 0.3 is received at 0.2 too
        outcome = np.where(draws < 1.0 - given.per, RECEIVED, NOISE_LOSS)
        outcome[receivers.distance > given.range] = UNNOTICED
        phase = 4.0 * math.pi * given.carrier_frequency / SPEED_OF_LIGHT
        loss = free_space_loss(receivers.distance, phase)
        power = given.transmit_power + frame.power_offset - loss
        return Verdicts(
            outcome=outcome.astype(np.uint8),
            delay=usual_delay,
            power_dbm=power,
            snir_db=np.where(outcome == UNNOTICED, np.nan, power - given.noise_floor),
            link=np.full(len(power), _LOS, np.uint8),
        )
