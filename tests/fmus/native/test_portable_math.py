"""The units' own elementary functions, against Python's."""

import ctypes
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.native.unit import compile_parts, load_unit

WRAPPER = """
#include "portable_math.h"
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
EXPORT double log_(double x) { return natural_logarithm(x); }
EXPORT double log1p_(double x) { return natural_logarithm_of_one_plus(x); }
EXPORT double exp_(double x) { return exponential(x); }
EXPORT double pow_(double x, double y) { return power(x, y); }
EXPORT double erfc_(double x) { return complementary_error(x); }
EXPORT double atan2_(double y, double x) { return direction_angle(y, x); }
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., float]:
    folder: Path = tmp_path_factory.mktemp("math")
    (folder / "wrapper.c").write_text(WRAPPER)
    loaded = compile_parts(
        load_unit("channel"), ["portable_math.c"], wrapper=folder / "wrapper.c", folder=folder
    )

    def call(name: str, *arguments: float) -> float:
        function: Any = getattr(loaded, f"{name}_")
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_double] * len(arguments)
        return float(function(*arguments))

    return call


def _magnitudes(low: float, high: float) -> list[float]:
    return [float(x) for x in np.logspace(np.log10(low), np.log10(high), 2001)]


def test_logarithm(functions: Callable[..., float]) -> None:
    near_one = [1 + k * 1e-4 for k in range(-2000, 2000)]
    for x in (*_magnitudes(1e-307, 1e307), *near_one, 0.5, 1.0, 2.0):
        assert functions("log", x) == pytest.approx(math.log(x), rel=1e-15, abs=0)
    assert functions("log", 0.0) == -math.inf


def test_logarithm_of_one_plus(functions: Callable[..., float]) -> None:
    for x in _magnitudes(1e-300, 0.99):
        for value in (x, -x):
            assert functions("log1p", value) == pytest.approx(math.log1p(value), rel=2e-15, abs=0)
    assert functions("log1p", 0.0) == 0.0


def test_exponential(functions: Callable[..., float]) -> None:
    for x in np.linspace(-708, 709, 20_001):
        expected = math.exp(x)
        assert functions("exp", x) == pytest.approx(expected, rel=1e-15 * (1 + abs(x)), abs=0)
    assert (functions("exp", -1e4), functions("exp", 1e4)) == (0.0, math.inf)
    assert functions("exp", 0.0) == 1.0


def test_power(functions: Callable[..., float]) -> None:
    rng = np.random.default_rng(1)
    for x, y in zip(np.exp(rng.uniform(-60, 60, 5000)), rng.uniform(-5, 5, 5000), strict=True):
        bound = 1e-15 * (2 + abs(y * math.log(x)))
        assert functions("pow", x, y) == pytest.approx(x**y, rel=bound, abs=0)
    assert functions("pow", 7.0, 0.0) == 1.0


def test_complementary_error_function(functions: Callable[..., float]) -> None:
    for x in (*np.linspace(0, 26, 20_001), *_magnitudes(1e-12, 1)):
        bound = 1e-15 * (1 + x * x)
        assert functions("erfc", x) == pytest.approx(math.erfc(x), rel=bound, abs=0)
    assert functions("erfc", 100.0) == 0.0


def test_direction(functions: Callable[..., float]) -> None:
    for angle in np.linspace(-math.pi, math.pi, 10_001):
        for radius in (1e-9, 1.0, 1e9):
            y, x = radius * math.sin(angle), radius * math.cos(angle)
            assert functions("atan2", y, x) == pytest.approx(math.atan2(y, x), rel=1e-15, abs=4e-16)
    assert functions("atan2", 0.0, 0.0) == 0.0
    assert functions("atan2", 0.0, -1.0) == math.pi
