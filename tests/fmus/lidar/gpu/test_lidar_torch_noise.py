"""The random numbers against other sources."""

from statistics import NormalDist

import numpy as np
import torch

from fmus.lidar.gpu.noise import (
    high_half,
    low_half,
    normal_quantile,
    random_bits,
    ray_salts,
    scan_key,
)


def test_the_bits_are_those_of_splitmix64(device: str) -> None:
    """The first outputs for the seed 1234567, as Rosetta Code lists them ("Pseudo-random
    numbers/Splitmix64")."""
    expected = [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    bits = random_bits(1234567 + ray_salts(1, 5).to(device)).cpu().numpy()
    assert bits.view(np.uint64).tolist() == expected
    halves = torch.from_numpy(bits).to(device)
    assert low_half(halves).tolist() == [x % 2**32 for x in expected]
    assert high_half(halves).tolist() == [x // 2**32 for x in expected]


def test_rays_and_scans_have_numbers_of_their_own() -> None:
    assert len(np.unique(ray_salts(1024, 512).numpy())) == 1024 * 512
    keys = {scan_key(s, t, v) for s in (-1, 0, 1) for t in (0, 10**8, -(10**8)) for v in range(100)}
    assert len(keys) == 900
    assert all(-(2**63) <= key < 2**63 for key in keys)


def test_quantiles_are_those_of_the_normal_distribution(device: str) -> None:
    """To the 1e-7 of AS 241's routine PPND7; Python has PPND16."""
    edges = [0, 1, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1]
    middle = torch.linspace(0, 2**32 - 1, 5001, dtype=torch.float64).long().tolist()
    bits = torch.tensor(edges + middle)
    expected = [NormalDist().inv_cdf((b + 0.5) / 2**32) for b in bits.tolist()]
    found = normal_quantile(bits.to(device)).cpu().numpy()
    np.testing.assert_allclose(found, expected, rtol=3e-7, atol=1e-15)
    np.testing.assert_allclose(found[:6], -found[:6][::-1], rtol=1e-9)
