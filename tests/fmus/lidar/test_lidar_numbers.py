"""The unit's own elementary functions, against Python's."""

import ctypes
import math
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

from fmus.common.build import COMMON, fmi_headers, load_unit
from fmus.common.targets import compile_library, select_targets

WRAPPER = """
#include "portable_math.h"
#include "random.h"
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
EXPORT double quantile(uint32_t bits) { return normal_quantile(bits); }
EXPORT double logarithm(double x) { return natural_logarithm(x); }
EXPORT double sine(double x) { double s, c; sine_cosine(x, &s, &c); return s; }
EXPORT double cosine(double x) { double s, c; sine_cosine(x, &s, &c); return c; }
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder: Path = tmp_path_factory.mktemp("numbers")
    (folder / "wrapper.c").write_text(WRAPPER)
    (target,) = select_targets(["host"])
    unit = load_unit("lidar").folder
    library = folder / f"numbers{target.suffix}"
    compile_library(
        target,
        sources=[folder / "wrapper.c", unit / "random.c", COMMON / "portable_math.c"],
        include=[unit, COMMON],
        system_include=fmi_headers(),
        library=library,
    )
    loaded = ctypes.CDLL(str(library))
    for name in ("quantile", "logarithm", "sine", "cosine"):
        function = getattr(loaded, name)
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_uint32 if name == "quantile" else ctypes.c_double]
    return loaded


def test_normal_quantiles(functions: ctypes.CDLL) -> None:
    grid = np.linspace(0, 2**32 - 1, 20_001).astype(np.uint64).tolist()
    tails = [2**k for k in range(32)] + [2**32 - 2**k for k in range(32)]
    for bits in (*grid, *tails):
        expected = NormalDist().inv_cdf((bits + 0.5) / 2**32)
        assert functions.quantile(bits) == pytest.approx(expected, rel=2e-7, abs=1e-9)


def test_sine_and_cosine(functions: ctypes.CDLL) -> None:
    rng = np.random.default_rng(0)
    grid = np.arange(-64, 65) * (math.pi / 8)
    for x in (*grid.tolist(), *rng.uniform(-10, 10, 5000), *rng.uniform(-1e6, 1e6, 5000)):
        assert functions.sine(x) == pytest.approx(math.sin(x), rel=0, abs=4e-16)
        assert functions.cosine(x) == pytest.approx(math.cos(x), rel=0, abs=4e-16)


def test_logarithm(functions: ctypes.CDLL) -> None:
    for x in np.geomspace(1e-300, 1e300, 5001).tolist():
        assert functions.logarithm(x) == pytest.approx(math.log(x), rel=0, abs=1.5e-10)
