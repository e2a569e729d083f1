"""What FMUs say of their units, and connections that convert by it."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from adapters.fmi.unit_definitions import read_definitions
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import SystemStructureError
from orchestrator.operation import spelled
from orchestrator.recording.recorder import Recorder
from orchestrator.remote.declarations import _connector, _describe
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.transformation import PLAIN, Transformation
from orchestrator.unit_table import exponents
from orchestrator.units import Unit, parse_unit
from tests.idle import Idle

MS = 1_000_000

UNITS = """\
<fmiModelDescription><UnitDefinitions>
  <Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit>
  <Unit name="degF"><BaseUnit K="1" factor="0.5555555555555556" offset="255.3722222222222"/></Unit>
  <Unit name="apples"/>
  <Unit name="broken"><BaseUnit m="one"/></Unit>
  <Unit name="nothing"><BaseUnit m="1" factor="0"/></Unit>
  <Unit name="much"><BaseUnit m="1" factor="inf"/></Unit>
</UnitDefinitions></fmiModelDescription>
"""


def test_definitions_are_exact_and_unsound_ones_are_none() -> None:
    found = read_definitions(ET.fromstring(UNITS))  # noqa: S314 - our own text
    assert set(found) == {"km/h", "degF"}
    assert found["km/h"].factor == Fraction("0.2777777777777778")
    assert found["km/h"].exponents == exponents(m=1, s=-1)
    assert found["degF"].offset == Fraction("255.3722222222222")


def test_the_connectors_of_an_fmu_have_its_definitions_also_elsewhere(lag2: Path) -> None:
    connector = FmuComponentType(lag2).create("a", {}).connectors["u"]
    assert connector.definition is not None
    assert connector.definition.exponents == exponents(kg=1, m=2, s=-3, A=-1)
    sent = _connector(_describe(connector), connector.start)
    assert sent.definition == connector.definition
    assert sent.is_relative == connector.is_relative


def test_units_of_one_name_are_converted_if_they_are_defined_in_two_ways() -> None:
    def ends(factor: int) -> System:
        metre = parse_unit("m")
        other = Unit("m", Fraction(factor), metre.exponents)
        output = Connector(causality=Causality.OUTPUT, unit="m", definition=other)
        input_ = Connector(causality=Causality.INPUT, unit="m", definition=metre)
        parts = {"a": Fixed({"y": output}), "b": Fixed({"u": input_})}
        wire = Connection(Endpoint("a", "y"), Endpoint("b", "u"))
        return System(parts, dict.fromkeys(parts, MS), [wire])

    assert ends(1).mixes["b"] == ()
    (mix,) = ends(3).mixes["b"]
    assert spelled(mix.parts[0].terms[0].operations) == "* 3"


class Fixed(Idle):
    """Has these connectors."""

    def __init__(self, connectors: Mapping[str, Connector]) -> None:
        self._connectors = connectors

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def outputs(self) -> Signals:
        return {}


def _wired(kind: FmuComponentType, way: Transformation, size: int = 3) -> System:
    components = {f"c{k}": kind.create(f"c{k}", {}) for k in range(size)}
    wires = [
        Connection(Endpoint("c0", "x"), Endpoint("c1", "u"), way),
        Connection(Endpoint("c0", "x"), Endpoint("c2", "u")),
        Connection(Endpoint("c1", "count_out"), Endpoint("c2", "count_in")),
    ]
    return System(components, {"c0": MS, "c1": 10 * MS, "c2": MS}, wires)


@pytest.mark.parametrize("algorithm", [GaussSeidel(), Jacobi()])
@pytest.mark.parametrize(
    "way",
    [
        PLAIN,
        Transformation(gain=0.1, offset=3.0),
        Transformation(delay=7 * MS),
        Transformation(sample=20 * MS, gain=-1.0),
    ],
)
def test_compiled_runs_have_the_bytes_of_python(
    lag2: Path, tmp_path: Path, way: Transformation, algorithm: CosimulationAlgorithm
) -> None:
    found = []
    for compiled in (False, True):
        recorder = Recorder(tmp_path / str(compiled))
        system = _wired(FmuComponentType(lag2), way)
        simulate(
            system,
            algorithm,
            start=0,
            stop=300 * MS,
            seed=1,
            observers=[recorder],
            compiled=compiled,
        )
        found.append(recorder.fingerprint)
    assert found[0] == found[1]


def test_an_fmu_of_volts_takes_no_metres(lag2: Path, fmu: Callable[[str], Path]) -> None:
    components = {
        "a": FmuComponentType(lag2).create("a", {}),
        "b": FmuComponentType(fmu("mirror")).create("b", {}),
    }
    wire = Connection(Endpoint("a", "count_out"), Endpoint("b", "float64.in"))
    with pytest.raises(SystemStructureError, match="shapes differ"):
        System(components, dict.fromkeys(components, MS), [wire])
    assert np.dtype(components["b"].connectors["float64.in"].dtype) == np.float64
