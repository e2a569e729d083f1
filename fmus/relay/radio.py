"""What a radio receives, as the ego believes: the channel's budget and error model in NumPy.

Formulas and defaults are those of docs/physics-channel.md; they are tables here, computed once.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from fmus.physics.error_rate import frame_success
from fmus.physics.propagation import free_space_loss
from orchestrator.signal import Array

_GRID: Final = np.arange(-40.0, 80.0, 0.1)
"""SNR of the table of success [dB]."""
_KERNEL: Final = np.arange(-40.0, 40.05, 0.1)
"""Deviations from the mean power over which success is averaged [dB]."""
_LEAST: Final = 1e-12


@dataclass(frozen=True, kw_only=True)
class Radio:
    """The radios of all vehicles, at 6 Mbit/s.

    Attributes:
        transmit_power: [dBm].
        noise_floor: [dBm].
        sensitivity: frames below are not noticed [dBm].
        cca_threshold: powers on air from here on keep a radio from sending [dBm].
        missed: probability that a radio misses the start of a frame, because it is locked on
            another one.
        capture_margin: a frame stronger than the others by this captures a receiver [dB].
        wavelength: [m].
        packet_size: of the packets with MAC and LLC [byte].
        fading_m: shape of Nakagami fading; 0: none.
        uncertainty: standard deviation of predicted powers [dB].
    """

    transmit_power: float
    noise_floor: float
    sensitivity: float
    cca_threshold: float
    missed: float
    capture_margin: float
    wavelength: float
    packet_size: int
    fading_m: float
    uncertainty: float

    def free_space(self, distance: Array) -> Array:
        """Received power without obstacles (ITU-R P.525-4, equation (3)).

        Args:
            distance: between the antennas [m], any shape.

        Returns:
            Power [dBm], of the shape of `distance`.
        """
        phase = 4.0 * np.pi / self.wavelength
        return np.asarray(self.transmit_power - free_space_loss(distance, phase))

    def success(self, snr_db: Array) -> Array:
        """Probability that noise spares a frame.

        Args:
            snr_db: mean signal to noise ratio [dB], any shape.

        Returns:
            Probability, of the same shape.
        """
        return np.interp(snr_db, _GRID, self._success)

    def notices(self, power: Array) -> Array:
        """Probability that a frame is not below the sensitivity.

        Args:
            power: mean received power [dBm], any shape.

        Returns:
            Probability, of the same shape.
        """
        return np.interp(power - self.sensitivity, _KERNEL, self._above)

    def unheard(self, power: Array) -> Array:
        """Probability that a radio sends in spite of another's frame.

        A frame that is not below the sensitivity keeps it from sending, unless it missed the
        start; then only a power of `cca_threshold` does (docs/physics-packets.md, "Carrier
        sense").

        Args:
            power: mean power of the frame at that radio [dBm], any shape.

        Returns:
            Probability, of the same shape.
        """
        strong = np.interp(power - self.cca_threshold, _KERNEL, self._above)
        noticed = self.notices(power)
        return np.asarray(1.0 - noticed + noticed * self.missed * (1.0 - strong))

    def with_noise(self, power: Array) -> Array:
        """Interference and noise together.

        Args:
            power: of the interference [dBm], any shape.

        Returns:
            Power [dBm], of the same shape.
        """
        return np.asarray(
            10.0 * np.log10(10.0 ** (power / 10.0) + 10.0 ** (self.noise_floor / 10.0))
        )

    def overlapped(self, signal: Array, other: Array, other_first: float) -> Array:
        """Probability that a frame is lost because another overlaps with it.

        If the other comes first and is noticed, the receiver is locked on it, unless this
        one is stronger by `capture_margin`; else it interferes.

        Args:
            signal: power of the frame [dBm], any shape.
            other: power of the other [dBm], of a shape that broadcasts.
            other_first: probability that the other comes first.

        Returns:
            Probability, of the broadcast shape.
        """
        ratio = signal - self.with_noise(other)
        captured = np.interp(ratio - self.capture_margin, _KERNEL, self._above)
        alone = np.maximum(self.success(signal - self.noise_floor), _LEAST)
        spoiled = 1.0 - np.minimum(self.success(ratio) / alone, 1.0)
        locked = np.maximum(self.notices(other) * (1.0 - captured), spoiled)
        return np.asarray(other_first * locked + (1.0 - other_first) * spoiled)

    @cached_property
    def _success(self) -> Array:
        """Success at each SNR of `_GRID`, averaged over fading and uncertainty."""
        wide = np.arange(_GRID[0] + _KERNEL[0], _GRID[-1] - _KERNEL[0] + 0.15, 0.1)
        plain = np.array([frame_success(float(snr), self.packet_size) for snr in wide])
        return np.convolve(plain, self._deviation[::-1], mode="valid")[: len(_GRID)]

    @cached_property
    def _above(self) -> Array:
        """Probability that a deviation makes up for a lack of -`_KERNEL` dB."""
        weights = self._deviation[::-1]
        return np.clip(np.cumsum(weights) - weights / 2.0, 0.0, 1.0)

    @cached_property
    def _deviation(self) -> Array:
        """Probability of each deviation of `_KERNEL`."""
        weights = _normal(self.uncertainty)
        if self.fading_m > 0.0:
            weights = np.convolve(weights, _gamma(self.fading_m), mode="same")
        return np.asarray(weights / weights.sum())


def _normal(deviation: float) -> Array:
    """Weights of `_KERNEL`, normally distributed; all on 0 for no deviation."""
    if deviation == 0.0:
        return np.asarray(np.abs(_KERNEL) < 0.05, np.float64)
    weights = np.exp(-0.5 * (_KERNEL / deviation) ** 2)
    return np.asarray(weights / weights.sum())


def _gamma(shape: float) -> Array:
    """Weights of `_KERNEL` where the power factor has a Gamma distribution of mean 1."""
    factor = 10.0 ** (_KERNEL / 10.0)
    weights = np.exp(shape * (np.log(factor) - factor))
    return np.asarray(weights / weights.sum())
