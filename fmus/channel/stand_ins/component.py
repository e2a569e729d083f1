"""What all stand-ins for the channel share as components."""

import abc

import numpy as np
from typing_extensions import override

from fmus.channel.stand_ins.connectors import CONNECTORS
from fmus.channel.stand_ins.delivery import Delivery, DeliveryState, LinkModel
from fmus.channel.stand_ins.inputs import Inputs
from fmus.channel.stand_ins.parameters import RadioParameters, refuse
from orchestrator.capabilities import Redrawing
from orchestrator.component import RestorableComponent
from orchestrator.signal import Causality, Signals
from orchestrator.timebase import Duration, Time


class LinkModelComponent(RestorableComponent[tuple[DeliveryState, Signals]], Redrawing):
    """A channel made of a link model: the base of channel models of one's own.

    Derive from it, make the model in `link_model`, and offer the class by an entry point in the
    group `orchestrator.components`; then a scenario can name it as the `type` of its component
    `channel`. `fmus.channel.stand_ins` has all names that this takes: this class, `LinkModel`,
    `Receivers`, `Verdicts`, `RadioParameters`, and `reception_draws` for random numbers that depend
    on the seed, the packet, the hop and the receiver, and on nothing else. Everything else is the
    same for all: connectors, packets on their routes, times on air, relays and the busy ratio.
    A model with parameters nests a frozen dataclass `Parameters` that derives from
    `RadioParameters`, and hands it to this constructor.

    Args:
        parameters: of the radios.

    Raises:
        ComponentTypeError: values of `parameters` are wrong; all of them are named.
    """

    connectors = CONNECTORS
    Parameters = RadioParameters

    def __init__(self, parameters: RadioParameters) -> None:
        refuse(parameters)
        self._radio_parameters = parameters

    @abc.abstractmethod
    def link_model(self, seed: int) -> LinkModel:
        """A link model that has judged nothing yet; called once per run, and per redrawn branch.

        Args:
            seed: of its draws, 0..2^64-1.
        """

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._start = start
        given = self._radio_parameters.seed
        drawn = int(rng.integers(2**64, dtype=np.uint64))
        model = self.link_model(drawn if given is None else given)
        self._delivery = Delivery(self._radio_parameters, model, start)
        self._outputs: Signals = {
            name: connector.start_value()
            for name, connector in CONNECTORS.items()
            if connector.causality is Causality.OUTPUT
        }

    @override
    def redraw(self, rng: np.random.Generator) -> None:
        known = self._delivery.save()
        model = self.link_model(int(rng.integers(2**64, dtype=np.uint64)))
        self._delivery = Delivery(self._radio_parameters, model, self._start)
        self._delivery.restore(known)

    @override
    def initialise(self, inputs: Signals) -> None:
        self._outputs = {**self._outputs, "busy_ratio": np.zeros(len(Inputs.read(inputs).id))}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._outputs = self._delivery.step(Inputs.read(inputs), t, h)

    @override
    def outputs(self) -> Signals:
        return self._outputs

    @override
    def save(self) -> tuple[DeliveryState, Signals]:
        return self._delivery.save(), self._outputs

    @override
    def restore(self, state: tuple[DeliveryState, Signals]) -> None:
        delivery, self._outputs = state
        self._delivery.restore(delivery)
