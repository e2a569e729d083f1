"""The relay of largest expected PRR over the window, from what the ego knows."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.expectation import Expectation, Losses
from fmus.relay.policy import Choice, Policy, Situation
from fmus.relay.prediction import Horizon
from fmus.relay.radio import SPEED_OF_LIGHT, Radio
from fmus.relay.selection import RelaySelection, SelectionParameters
from fmus.relay.surroundings import Surroundings
from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import Time, nanoseconds


class ExpectedPrr(RelaySelection):
    """The relay, or the direct link, over which most packets are expected to arrive.

    It knows what MoHeD knows, and the powers that signal strength knows. It moves radios and
    bodies on along their velocities and computes, at instants of the window, the power of each
    hop as the channel would, the probability that noise spares a packet, and the probability
    that frames of radios that do not hear each other overlap. The choice is made when MoHeD
    makes it.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """What the ego believes of radios, medium and its own knowledge."""

        gain: float = parameter(
            0.03, minimum=0.0, maximum=1.0, doc="expected PRR that another choice must add"
        )
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
        missed: float = parameter(
            0.3,
            minimum=0.0,
            maximum=1.0,
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
        hidden: float = parameter(
            0.4,
            minimum=0.0,
            maximum=1.0,
            doc="probability that a body that obstructs a hop hides one more behind it",
        )
        hidden_body: float = parameter(12.0, unit="dB", minimum=0.0, doc="what a hidden body costs")
        bsm_overlap: float = parameter(
            0.0074,
            minimum=0.0,
            maximum=1.0,
            doc="probability that a BSM of one neighbour is on the air while a packet is, where "
            "neither radio hears the other: twice 368 us, 10 times a second",
        )
        apm_overlap: float = parameter(
            0.05,
            minimum=0.0,
            maximum=1.0,
            doc="the same of the ego's own APM: 4.9 ms somewhere in the 100 ms between scans; 0.4 "
            "where all send within 10 ms of the same scan (`processing_time` of the facilities)",
        )
        contention: float = parameter(
            0.05,
            minimum=0.0,
            maximum=1.0,
            doc="share of the packets over a relay that are lost because the sharer sends while "
            "the relay forwards",
        )
        same_body: float = parameter(
            1.0, unit="m", minimum=0.0, doc="distance at which two sources mean one obstacle"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._parameters = parameters

    @override
    def _policy(self, rng: np.random.Generator) -> Policy:
        given = self._parameters
        radio = Radio(
            transmit_power=given.transmit_power,
            noise_floor=given.noise_floor,
            sensitivity=given.sensitivity,
            cca_threshold=given.cca_threshold,
            missed=given.missed,
            capture_margin=given.capture_margin,
            wavelength=SPEED_OF_LIGHT / given.carrier_frequency,
            frame_size=given.packet_size,
            fading_m=given.fading_m,
            uncertainty=given.uncertainty,
        )
        losses = Losses(
            wall=given.wall_loss,
            indoor=given.indoor_loss,
            bsm_overlap=given.bsm_overlap,
            apm_overlap=given.apm_overlap,
            hidden=given.hidden,
            hidden_body=given.hidden_body,
            contention=given.contention,
        )
        horizon = Horizon.over(given.window, given.sample)
        return LargestExpectation(
            Expectation(radio, losses, horizon, given.correction_time),
            Surroundings(given.same_body, nanoseconds(given.lost_after)),
            given.gain,
        )


class LargestExpectation(Policy):
    """The candidate, or the direct link, of largest expected PRR.

    Args:
        expectation: the expected PRR of each.
        surroundings: what stands between the nodes.
        gain: by how much another choice must exceed the current one.
    """

    def __init__(self, expectation: Expectation, surroundings: Surroundings, gain: float) -> None:
        self._expectation = expectation
        self._surroundings = surroundings
        self._gain = gain

    @override
    def remember(self, inputs: Signals, now: Time) -> None:
        self._surroundings.remember(inputs, now)

    @override
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        expected = self.expected(situation, inputs)
        current = situation.current
        best = min(expected, key=lambda relay: (-expected[relay], *situation.tie_break(relay)))
        stays = current in expected and expected[best] <= expected[current] + self._gain
        return Choice(relay=current if stays and current is not None else best)

    def expected(self, situation: Situation, inputs: Signals) -> dict[int, float]:
        """The expected PRR over each candidate, and of the direct link."""
        obstacles = self._surroundings.obstacles(situation, inputs)
        walls = self._surroundings.walls(inputs)
        values = self._expectation.of_routes(situation, inputs, obstacles, walls)
        return dict(zip([NO_VEHICLE, *situation.candidates], values.tolist(), strict=True))
