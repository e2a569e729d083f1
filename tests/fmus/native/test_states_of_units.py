"""A saved state has the parameters of its instance; what could not be set cannot be loaded."""

import struct
from collections.abc import Iterator
from typing import Final

import numpy as np
import pytest

from fmus.native.interface import Variable
from fmus.native.unit import UNITS, load_unit
from orchestrator.signal import Array
from tests.fmus.driver import Instance, Library, Refused

pytestmark = pytest.mark.slow

ENVELOPE: Final = struct.Struct("<8sQQ")
HEADER: Final = 32
DTYPES: Final = {
    "Float64": np.float64,
    "Int32": np.int32,
    "UInt32": np.uint32,
    "Enumeration": np.int64,
}


def sealed(body: bytes) -> bytes:
    """A state in an envelope with the right checksum (FNV-1a)."""
    checksum = 14695981039346656037
    for byte in body:
        checksum = (checksum ^ byte) * 1099511628211 % 2**64
    return ENVELOPE.pack(b"FMU3STA1", checksum, len(body)) + body


def places(variables: tuple[Variable, ...], body: bytes) -> dict[str, int]:
    """Where the elements of each variable begin in the body of a state."""
    found = {}
    at = HEADER + 16 * sum(v.causality == "structuralParameter" for v in variables)
    for name in ["time", *(v.name for v in variables if v.causality != "structuralParameter")]:
        found[name] = at + 8
        at += 8 + int.from_bytes(body[at : at + 8], "little")
    return found


def outside(variable: Variable) -> Iterator[Array]:
    """Values that the variable cannot be set to, each as an element of its type."""
    dtype = DTYPES[variable.type]
    low = 1 if variable.items else variable.minimum
    high = len(variable.items) if variable.items else variable.maximum
    if dtype is np.float64:
        yield np.array([np.nan])
        yield np.array([np.inf])
    if low is not None and not (low == 0 and variable.type.startswith("U")):
        yield np.array([low - 1], dtype)
    if high is not None:
        yield np.array([high + 1], dtype)


@pytest.fixture(scope="module", params=UNITS)
def library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library.build(request.param, tmp_path_factory.mktemp(request.param))


def begun(library: Library) -> Instance:
    instance = Instance(library)
    empty = ("n_vehicle", "n_building", "n_building_vertex")
    instance.resize(**{name: 0 for name in empty if name in library.variables})
    instance.enter_initialization()
    instance.call("ExitInitializationMode")
    return instance


def test_no_state_brings_a_parameter_that_could_not_be_set(library: Library) -> None:
    variables = load_unit(library.name).interface.variables
    tried = 0
    with begun(library) as instance:
        instance.do_step(0.0, 0.1)
        sound = instance.save()
        body = sound[ENVELOPE.size :]
        where = places(variables, body)
        bounded = [v for v in variables if v.causality == "parameter" and v.type in DTYPES]
        for variable in bounded:
            for value in outside(variable):
                at = where[variable.name]
                damaged = body[:at] + value.tobytes() + body[at + value.nbytes :]
                with pytest.raises(Refused, match=f"element 0 of `{variable.name}` is"):
                    instance.restore(sealed(damaged))
                tried += 1
        assert instance.save() == sound
        instance.restore(sealed(body))
        instance.do_step(0.1, 0.1)
    assert tried > 2 * len(bounded) >= 20
