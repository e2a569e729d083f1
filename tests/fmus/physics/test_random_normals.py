"""Random numbers by counter: other sources of the bits, of the quantiles, and the units' C."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

from fmus.native.unit import compile_parts, load_unit
from fmus.physics.random_normals import STRIDE, mixed_bits, standard_normals

WRAPPER = """
#include "random_normal.h"
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
EXPORT double normal_(uint32_t bits) { return standard_normal(bits); }
EXPORT uint64_t mixed_(uint64_t bits) { return mixed_bits(bits); }
"""
BITS = np.concatenate(
    [
        np.arange(0, 2**32, 2**32 // 4001, dtype=np.uint64),
        np.array([0, 1, 2, 322122546, 322122547, 322122548, 2**31 - 1, 2**31], np.uint64),
        np.array([2**32 - 322122549 + k for k in range(3)] + [2**32 - 2, 2**32 - 1], np.uint64),
    ]
)
"""32 random bits: all over their range, at the ends of it, and where middle and tails meet."""


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> tuple[Callable[[int], float], ...]:
    folder: Path = tmp_path_factory.mktemp("normals")
    (folder / "wrapper.c").write_text(WRAPPER)
    loaded = compile_parts(
        load_unit("channel"),
        ["portable_math.c", "random_normal.c"],
        wrapper=folder / "wrapper.c",
        folder=folder,
    )
    loaded.normal_.restype, loaded.normal_.argtypes = ctypes.c_double, [ctypes.c_uint32]
    loaded.mixed_.restype, loaded.mixed_.argtypes = ctypes.c_uint64, [ctypes.c_uint64]
    return loaded.normal_, loaded.mixed_


def test_the_bits_are_those_of_splitmix64() -> None:
    """The first outputs for the seed 1234567, as Rosetta Code lists them ("Pseudo-random
    numbers/Splitmix64")."""
    counter = np.array([(1234567 + (k + 1) * STRIDE) % 2**64 for k in range(5)], np.uint64)
    assert mixed_bits(counter).tolist() == [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]


def test_quantiles_are_those_of_the_standard_library() -> None:
    """Which are from AS 241's other routine, to 1e-16; this one is good to 1e-7."""
    normal = NormalDist()
    expected = [normal.inv_cdf((b + 0.5) / 2**32) for b in BITS.tolist()]
    found = standard_normals(BITS << np.uint64(32))
    np.testing.assert_allclose(found, expected, rtol=2e-7, atol=1e-9)


def test_they_are_the_numbers_of_the_native_units(
    compiled: tuple[Callable[[int], float], ...],
) -> None:
    """Bits are the same; quantiles but for the rounding of the logarithm in the tails."""
    normal, mixed = compiled
    assert [mixed(b) for b in BITS.tolist()] == mixed_bits(BITS).tolist()
    found = standard_normals(BITS << np.uint64(32))
    np.testing.assert_allclose(found, [normal(b) for b in BITS.tolist()], rtol=4e-16, atol=0)


def test_the_lower_half_of_the_bits_does_not_matter() -> None:
    upper = BITS << np.uint64(32)
    np.testing.assert_array_equal(
        standard_normals(upper), standard_normals(upper | np.uint64(2**32 - 1))
    )
