"""The binary layouts: NumPy and C agree, frames are checked."""

import ctypes
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

import fmus.native
from fmus.messages import records

HEADER = Path(fmus.native.__file__).with_name("records.h")
STRUCTS = {
    "Frame": records.FRAME,
    "Sensor": records.SENSOR,
    "Point": records.POINT,
    "Object": records.OBJECT,
    "ApmHeader": records.APM_HEADER,
    "ApmLayerCell": records.APM_LAYER_CELL,
    "Packet": records.PACKET,
    "Reception": records.RECEPTION,
    "TransmissionRecord": records.TRANSMISSION,
}
C_TYPES: dict[str, Any] = {
    "char": ctypes.c_char,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
} | {
    f"{sign}int{bits}_t": getattr(ctypes, f"c_{sign}int{bits}")
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
}


def struct(name: str) -> Any:
    """The struct `name` of records.h as a ctypes structure."""
    text = HEADER.read_text()
    body = re.search(r"typedef struct \{([^}]*)\} " + name + ";", text)
    assert body is not None
    fields = []
    for declaration in body[1].split(";"):
        words = declaration.split(maxsplit=1)
        if not words:
            continue
        for member in words[1].split(","):
            match = re.fullmatch(r"\s*(\w+)(?:\[(\d+)\])?\s*", member)
            assert match is not None
            kind = C_TYPES[words[0]]
            fields.append((match[1], kind * int(match[2]) if match[2] else kind))
    return type(name, (ctypes.Structure,), {"_fields_": fields})


@pytest.mark.parametrize("name", STRUCTS)
def test_c_and_numpy_declare_the_same_layout(name: str) -> None:
    dtype, c_type = STRUCTS[name], struct(name)
    assert dtype.names is not None
    assert dtype.fields is not None
    assert ctypes.sizeof(c_type) == dtype.itemsize
    ours = [(field, dtype.fields[field][1]) for field in dtype.names]
    theirs = [(field, getattr(c_type, field).offset) for field, _ in c_type._fields_]
    assert ours == theirs


def test_c_and_numpy_number_the_kinds_alike() -> None:
    text = HEADER.read_text()
    enums = [re.findall(r"\w+", body) for body in re.findall(r"enum \{([^}]*)\}", text)]
    kinds = ["BSM", "APM", "SENSOR_DATA", "REQUEST", "NOISE"]
    assert kinds in enums
    assert [getattr(records, kind) for kind in kinds] == [0, 1, 2, 3, 4]
    assert [fate.upper().replace(" ", "_") for fate in records.FATES] in enums
    (outcomes,) = (names for names in enums if "RECEIVED" in names)
    letters = {"RECEIVED": "R", "WEAK": "U"}
    found = [letters.get(name.removeprefix("LOST_"), name[len("LOST_")]) for name in outcomes]
    assert "".join(found) == records.OUTCOMES
    assert ["LOS", "NLOSV", "NLOSB"] in enums
    assert [name.upper() for name in records.LINKS] == ["LOS", "NLOSV", "NLOSB"]


@given(st.lists(st.integers(0, 2**62), max_size=20))
def test_a_frame_is_undone_by_unframe(ids: list[int]) -> None:
    rows = np.zeros(len(ids), records.PACKET)
    rows["id"] = ids
    np.testing.assert_array_equal(
        records.unframe("PKTS", records.frame("PKTS", rows), records.PACKET), rows
    )


def test_an_empty_signal_has_no_records() -> None:
    assert len(records.unframe("PKTS", b"", records.PACKET)) == 0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"short", "not a `PKTS` frame"),
        (records.frame("RCPT", np.zeros(1, records.RECEPTION)), "not a `PKTS` frame"),
        (records.frame("PKTS", np.zeros(1, records.RECEPTION)), "72 bytes, not 56"),
        (records.frame("PKTS", np.zeros(2, records.PACKET))[:-1], "2 records is cut short"),
    ],
)
def test_what_is_no_frame_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        records.unframe("PKTS", data, records.PACKET)
