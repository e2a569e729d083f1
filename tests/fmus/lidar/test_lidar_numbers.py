"""The unit's own elementary functions and tables, against Python's."""

import ctypes
import math
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.native.unit import compile_parts, load_unit

WRAPPER = """
#include "pattern.h"
#include "portable_math.h"
#include "random_normal.h"
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
EXPORT double quantile(uint32_t bits) { return standard_normal(bits); }
EXPORT void quantiles(const uint32_t *bits, uint32_t count, double *normal) {
    standard_normals(bits, count, normal);
}
EXPORT double logarithm(double x) { return natural_logarithm(x); }
EXPORT double sine(double x) { double s, c; sine_cosine(x, &s, &c); return s; }
EXPORT double cosine(double x) { double s, c; sine_cosine(x, &s, &c); return c; }
static Pattern pattern;
EXPORT const double *prepare(uint32_t channels, uint32_t azimuths, double top, double bottom) {
    PatternParameters parameters = {channels, azimuths, top, bottom, 0.0, 0.0, 50.0};
    return pattern_prepare(&pattern, &parameters) ? 0 : pattern.slope;
}
EXPORT double channels_from(double slope) { return pattern_channels_from(&pattern, slope); }
EXPORT double azimuth_at(double x, double y) { return pattern_azimuth(&pattern, x, y); }
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder: Path = tmp_path_factory.mktemp("numbers")
    (folder / "wrapper.c").write_text(WRAPPER)
    loaded = compile_parts(
        load_unit("lidar"),
        ["pattern.c", "portable_math.c", "random_normal.c"],
        wrapper=folder / "wrapper.c",
        folder=folder,
    )
    for name in ("quantile", "logarithm", "sine", "cosine"):
        function = getattr(loaded, name)
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_uint32 if name == "quantile" else ctypes.c_double]
    for name, count in (("channels_from", 1), ("azimuth_at", 2)):
        function = getattr(loaded, name)
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_double] * count
    loaded.prepare.restype = ctypes.POINTER(ctypes.c_double)
    loaded.prepare.argtypes = [ctypes.c_uint32] * 2 + [ctypes.c_double] * 2
    return loaded


def test_normal_quantiles(functions: ctypes.CDLL) -> None:
    grid = np.linspace(0, 2**32 - 1, 20_001).astype(np.uint64).tolist()
    tails = [2**k for k in range(32)] + [2**32 - 2**k for k in range(32)]
    for bits in (*grid, *tails):
        expected = NormalDist().inv_cdf((bits + 0.5) / 2**32)
        assert functions.quantile(bits) == pytest.approx(expected, rel=2e-7, abs=1e-9)


@given(st.lists(st.integers(0, 2**32 - 1) | st.integers(322122545, 322122549), max_size=200))
def test_many_normal_quantiles_are_those_of_each(functions: ctypes.CDLL, bits: list[int]) -> None:
    found = (ctypes.c_double * len(bits))()
    functions.quantiles((ctypes.c_uint32 * len(bits))(*bits), ctypes.c_uint32(len(bits)), found)
    assert list(found) == [functions.quantile(b) for b in bits]


def test_sine_and_cosine(functions: ctypes.CDLL) -> None:
    rng = np.random.default_rng(0)
    grid = np.arange(-64, 65) * (math.pi / 8)
    for x in (*grid.tolist(), *rng.uniform(-10, 10, 5000), *rng.uniform(-1e6, 1e6, 5000)):
        assert functions.sine(x) == pytest.approx(math.sin(x), rel=0, abs=4e-16)
        assert functions.cosine(x) == pytest.approx(math.cos(x), rel=0, abs=4e-16)


def test_logarithm(functions: ctypes.CDLL) -> None:
    for x in np.geomspace(1e-300, 1e300, 5001).tolist():
        assert functions.logarithm(x) == pytest.approx(math.log(x), rel=0, abs=1.5e-10)


@given(
    channels=st.integers(1, 512),
    top=st.floats(-1.5, 1.5),
    span=st.floats(1e-17, 3.0),
    limits=st.lists(st.floats(-20, 20) | st.sampled_from([math.inf, -math.inf])),
)
def test_channels_are_found_by_their_slope(
    functions: ctypes.CDLL, channels: int, top: float, span: float, limits: list[float]
) -> None:
    """Channels may be so close together that some of their slopes are equal."""
    slopes = functions.prepare(channels, 4, top, max(top - span, -1.5))[:channels]
    assert slopes == sorted(slopes, reverse=True)
    beside = [math.nextafter(s, way) for s in slopes for way in (math.inf, -math.inf)]
    for limit in (*limits, *slopes, *beside):
        assert functions.channels_from(limit) == sum(s >= limit for s in slopes)


@given(azimuths=st.integers(4, 8192), radius=st.floats(1e-12, 1e8))
def test_a_direction_belongs_to_the_azimuth_that_it_has_passed(
    functions: ctypes.CDLL, azimuths: int, radius: float
) -> None:
    """Just before and just after the azimuths, where a guess may be wrong."""
    functions.prepare(1, azimuths, 0.1, 0.0)
    for number in {0, 1, azimuths // 3, azimuths // 2, azimuths - 1}:
        for aside, expected in ((1e-9, number), (-1e-9, (number - 1) % azimuths)):
            angle = 2 * math.pi * number / azimuths + aside
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            assert functions.azimuth_at(x, y) == expected
