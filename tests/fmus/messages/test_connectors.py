"""A signal is declared once for Python units, as native units have it."""

import numpy as np
import pytest

from adapters.traffic import bodies as traffic
from adapters.traffic.connectors import VEHICLES
from fmus.channel.interface import INTERFACE as CHANNEL
from fmus.lidar.interface import INTERFACE as LIDAR
from fmus.messages.bodies import BODY_CODES, Body
from fmus.messages.connectors import SIGNALS, arrays_beneath, inputs, outputs
from fmus.native.interface import Interface
from fmus.perception.interface import INTERFACE as PERCEPTION
from orchestrator.signal import Causality

_DTYPES = {"Boolean": "bool"}


@pytest.mark.parametrize("unit", [CHANNEL, LIDAR, PERCEPTION], ids=lambda unit: unit.name)
def test_native_units_declare_the_same(unit: Interface) -> None:
    """Type, axes, unit and contents of all signals of this name; and there are some."""
    exchanged = [v for v in unit.variables if v.causality in {"input", "output"}]
    shared = [v for v in exchanged if v.name in SIGNALS]
    assert len(shared) > 5
    for variable in shared:
        signal = SIGNALS[variable.name]
        axes = tuple(
            axis.removeprefix("n_") if isinstance(axis, str) else axis
            for axis in variable.dimensions
        )
        assert (signal.shape, signal.unit) == (axes, variable.unit), variable.name
        if variable.type == "Binary":
            assert (signal.is_binary, signal.mime_type) == (True, variable.mime_type)
        else:
            dtype = _DTYPES.get(variable.type, variable.type.lower())
            assert np.dtype(signal.dtype) == np.dtype(dtype), variable.name


def test_traffic_and_units_number_bodies_alike() -> None:
    theirs = {body.name: body.value for body in traffic.Body}
    assert theirs == {body.name: body.value for body in Body}
    assert VEHICLES["vehicle.body"].description == BODY_CODES
    assert SIGNALS["vehicle.body"].description == BODY_CODES


def test_what_one_unit_writes_another_can_read() -> None:
    for name in SIGNALS:
        source, target = outputs(name)[name], inputs(name)[name]
        assert source.differences(target) == []


def test_outputs_name_what_affects_them() -> None:
    found = outputs("relay", "busy_ratio", feedthrough=["match.sharer"])
    assert [one.causality for one in found.values()] == [Causality.OUTPUT] * 2
    assert {one.feedthrough for one in found.values()} == {frozenset({"match.sharer"})}
    assert inputs("relay", description="taken, not used")["relay"].description == "taken, not used"


def test_the_arrays_beneath_a_name_are_those_that_are_declared_there() -> None:
    given = {name: signal.start_value() for name, signal in SIGNALS.items()}
    found = arrays_beneath(given, "received.link")
    assert {name: array.dtype for name, array in found.items()} == {
        "transmitter": np.int64,
        "receiver": np.int64,
        "power": np.float64,
    }
