"""Who fed whom, as `docs/coupling.md` tells it.

    fast (10 ns) <-> slow (30 ns);  fast -> tail (10 ns) <- slow

Every component outputs the time its output is valued at, so an input says how old it is.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import SystemStructureError
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Time

STEPS = {"fast": 10, "slow": 30, "tail": 10}
SOURCES = {"fast": ["slow"], "slow": ["fast"], "tail": ["fast", "slow"]}


def stamping(name: str, log: list[tuple[Time, str]]) -> FunctionComponent:
    connectors = {
        source: Connector(causality=Causality.INPUT, dtype=np.int64, unit="ns")
        for source in SOURCES[name]
    }
    stamp = Connector(causality=Causality.OUTPUT, dtype=np.int64, unit="ns")

    def function(reached: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        seen = " ".join(f"{source}@{int(np.asarray(inputs[source]))}" for source in SOURCES[name])
        if t > 0:
            step = f"{t - STEPS[name]:2} -> {t}  {name}  sees {seen}"
            log.append((t, step))
        return None, {"stamp": np.array(t)}

    return FunctionComponent({**connectors, "stamp": stamp}, function)


def who_fed_whom(algorithm: CosimulationAlgorithm, stop: Time) -> str:
    log: list[tuple[Time, str]] = []
    system = System(
        {name: stamping(name, log) for name in STEPS},
        STEPS,
        [
            Connection(Endpoint(source, "stamp"), Endpoint(name, source))
            for name, sources in SOURCES.items()
            for source in sources
        ],
    )
    simulate(system, algorithm, start=0, stop=stop, seed=0)
    names = list(STEPS)
    log.sort(key=lambda entry: (entry[0], names.index(entry[1].split()[3])))
    return "\n".join(line for _, line in log)


def documented() -> list[str]:
    page = Path(__file__).parents[2] / "docs" / "coupling.md"
    blocks = re.findall(r"```\n(.*?)```", page.read_text(), re.S)
    return [block.strip("\n") for block in blocks if " -> " in block]


@pytest.mark.parametrize(
    ("algorithm", "table"),
    [(Jacobi(), 0), (GaussSeidel(), 1), (GaussSeidel(("fast", "slow", "tail")), 1)],
)
def test_who_fed_whom(algorithm: CosimulationAlgorithm, table: int) -> None:
    expected = documented()[table].split("\n")
    assert who_fed_whom(algorithm, stop=60).split("\n")[: len(expected)] == expected


def test_the_order_of_turns_decides_what_is_seen() -> None:
    table = who_fed_whom(GaussSeidel(("tail", "slow", "fast")), stop=30)
    assert "20 -> 30  tail  sees fast@20 slow@0" in table
    assert " 0 -> 30  slow  sees fast@20" in table
    assert "20 -> 30  fast  sees slow@30" in table


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])
def test_a_step_size_that_does_not_divide_the_interval_is_refused(
    algorithm: CosimulationAlgorithm,
) -> None:
    with pytest.raises(SystemStructureError) as error:
        who_fed_whom(algorithm, stop=45)
    assert error.value.problems == (
        (
            "component `fast`: the interval of 45 ns is not a whole number of steps of 10 ns: "
            "5 ns are left over"
        ),
        (
            "component `slow`: the interval of 45 ns is not a whole number of steps of 30 ns: "
            "15 ns are left over"
        ),
        (
            "component `tail`: the interval of 45 ns is not a whole number of steps of 10 ns: "
            "5 ns are left over"
        ),
    )
