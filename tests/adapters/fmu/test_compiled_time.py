"""Wall time of calls that compiled code makes: they are their component's, as those of Python."""

from pathlib import Path

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.simulation import simulate
from orchestrator.system import System


def test_calls_by_compiled_code_count(lag2: Path) -> None:
    """Of two that cost as much to set up, the one with 2,000,000 steps takes most of the time."""
    lag, count = FmuComponentType(lag2), 2_000_000
    parts = {name: lag.create(name, {}) for name in ("often", "once")}
    steps = {"often": 10**6, "once": count * 10**6}
    system = System(parts, steps, ())
    wall = simulate(system, Jacobi(), start=0, stop=count * 10**6, seed=0).wall_time
    assert wall.components["often"] > 5 * wall.components["once"] > 0
    assert wall.components["often"] < wall.total
