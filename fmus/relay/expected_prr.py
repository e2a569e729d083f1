"""The relay of largest expected PRR over the window, from what the ego knows."""

from dataclasses import dataclass, fields
from typing import Any

from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.physics.propagation import wavelength
from fmus.relay.expectation import Expectation, Losses
from fmus.relay.obstacle_aware import ObstacleAwareParameters, ObstacleAwareSelection
from fmus.relay.prediction import Horizon
from fmus.relay.radio import Radio
from fmus.relay.situation import Choice, Situation
from orchestrator.parameters import parameter
from orchestrator.share import share


class ExpectedPrr(ObstacleAwareSelection):
    """The relay, or the direct link, over which most packets are expected to arrive.

    It knows what MoHeD knows, and the powers that signal strength knows. It moves radios and
    bodies on along their velocities and computes, at instants of the window, the power of each
    hop as the channel would, the probability that noise spares a packet, and the probability
    that frames of radios that do not hear each other overlap. The choice is made when MoHeD
    makes it.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(ObstacleAwareParameters):
        """What the ego believes of radios, medium and its own knowledge."""

        gain: float = share(0.03, doc="expected PRR that another choice must add")
        sample: float = parameter(
            0.25, unit="s", minimum=0.01, doc="longest time between the instants looked at"
        )
        uncertainty: float = parameter(
            4.0, unit="dB", minimum=0.0, doc="standard deviation of predicted powers"
        )
        correction_time: float = parameter(
            5.0,
            unit="s",
            minimum=0.001,
            doc="decay of what a measured power lacks of the computed one",
        )
        transmit_power: float = parameter(26.0, unit="dBm", doc="of all radios")
        noise_floor: float = parameter(-98.0, unit="dBm", doc="of all radios")
        sensitivity: float = parameter(-94.0, unit="dBm", doc="of all radios")
        cca_threshold: float = parameter(
            -65.0, unit="dBm", doc="power on air that keeps a radio from sending"
        )
        missed: float = share(
            0.3,
            doc="probability that a radio misses the start of a frame, locked on another one",
        )
        capture_margin: float = parameter(
            10.0, unit="dB", minimum=0.0, doc="a frame stronger by this captures a busy receiver"
        )
        carrier_frequency: float = parameter(5.9e9, unit="Hz", minimum=1e8, doc="of the radios")
        packet_size: int = parameter(
            238, unit="B", minimum=1, doc="of a frame with sensor data, MAC and LLC included"
        )
        fading_m: float = parameter(
            0.0, minimum=0.0, maximum=100.0, doc="shape of Nakagami fading; 0: none"
        )
        wall_loss: float = parameter(9.0, unit="dB", minimum=0.0, doc="per building wall")
        indoor_loss: float = parameter(
            0.4, unit="dB/m", minimum=0.0, doc="per metre inside buildings"
        )
        hidden: float = share(
            0.4,
            doc="probability that a body that obstructs a hop hides one more behind it",
        )
        hidden_body: float = parameter(12.0, unit="dB", minimum=0.0, doc="what a hidden body costs")
        bsm_overlap: float = share(
            0.0074,
            doc="probability that a BSM of one neighbour is on the air while a packet is, where "
            "neither radio hears the other: twice 368 us, 10 times a second",
        )
        apm_overlap: float = share(
            0.05,
            doc="the same of the ego's own APM: 4.9 ms somewhere in the 100 ms between scans; 0.4 "
            "where all send within 10 ms of the same scan (`processing_time` of the facilities)",
        )
        contention: float = share(
            0.05,
            doc="share of the packets over a relay that are lost because the sharer sends while "
            "the relay forwards",
        )

        @property
        def losses(self) -> Losses:
            """What else than noise costs power, or packets."""
            return Losses(**self._alike(Losses))

        @property
        def radio(self) -> Radio:
            """What all radios are believed to be."""
            return Radio(wavelength=wavelength(self.carrier_frequency), **self._alike(Radio))

        def _alike(self, record: type) -> dict[str, Any]:
            """The parameters that are fields of `record`, too."""
            names = {field.name for field in fields(record)}
            return {f.name: getattr(self, f.name) for f in fields(self) if f.name in names}

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._given = parameters
        horizon = Horizon.over(parameters.window, parameters.sample)
        self._expectation = Expectation(
            parameters.radio, parameters.losses, horizon, parameters.correction_time
        )

    @override
    def choose(self, situation: Situation) -> Choice:
        expected, current = self.expected(situation), situation.current
        best = situation.best(expected)
        if current in expected and expected[best] <= expected[current] + self._given.gain:
            return Choice(relay=current)
        return Choice(relay=best)

    def expected(self, situation: Situation) -> dict[int, float]:
        """The expected PRR over each candidate, and of the direct link, by number."""
        obstacles = self._surroundings.obstacles(situation)
        walls = self._surroundings.walls(situation.known)
        values = self._expectation.of_routes(situation, obstacles, walls)
        return dict(zip([NO_VEHICLE, *situation.candidates], values.tolist(), strict=True))
