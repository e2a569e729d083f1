"""Propagation of radio waves: the speed of light, free space and the knife edge."""

from typing import Final

import numpy as np

from orchestrator.signal import Array

SPEED_OF_LIGHT: Final = 299_792_458.0
"""The speed of light in vacuum [m/s], exact by the definition of the metre (SI brochure, 2.3.1)."""


def wavelength(carrier_frequency: float) -> float:
    """The wavelength in vacuum [m] at `carrier_frequency` [Hz]."""
    return SPEED_OF_LIGHT / carrier_frequency


def free_space_loss(distance: Array, phase: float) -> Array:
    r"""Path loss in free space, at least 0 dB.

    $$ PL = 20 \log_{10} (4 \pi d / \lambda) $$ (ITU-R P.525-4, equation (3))

    Args:
        distance: between the antennas [m], any shape.
        phase: 4 pi / lambda, by which the phase of a wave turns on the way there and back [rad/m].

    Returns:
        Path loss [dB], of the shape of `distance`.
    """
    return np.asarray(20.0 * np.log10(np.maximum(phase * distance, 1.0)))


def knife_edge_loss(v: Array) -> Array:
    r"""Diffraction loss of a single knife edge, 0 dB up to v = -0.7.

    $$ J(v) = 6.9 + 20 \log_{10} (\sqrt{(v - 0.1)^2 + 1} + v - 0.1) $$

    (ITU-R P.526-15, equation (31).)

    Args:
        v: the edge's height over the straight line in units of the Fresnel zone, any shape; ITU-R
            P.526-15, equation (26) says how it follows from lengths.

    Returns:
        Loss [dB], of the shape of `v`.
    """
    loss = 6.9 + 20.0 * np.log10(np.sqrt((v - 0.1) ** 2 + 1.0) + v - 0.1)
    return np.where(v > -0.7, loss, 0.0)
