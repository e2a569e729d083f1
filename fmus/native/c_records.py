"""The records and codes of `fmus.messages` in C: records.h."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages import records
from fmus.messages.bodies import BODY_CODES, Body

STRUCTS: Final = {
    "Frame": records.FRAME,
    "Sensor": records.SENSOR,
    "Point": records.POINT,
    "Object": records.OBJECT,
    "ApmHeader": records.APM_HEADER,
    "ApmLayerCell": records.APM_LAYER_CELL,
    "Features": records.FEATURES,
    "Packet": records.PACKET,
    "Reception": records.RECEPTION,
    "TransmissionRecord": records.TRANSMISSION,
}
"""Layouts by the names of their structs."""

CONSTANTS: Final = {
    "NO_VEHICLE": records.NO_VEHICLE,
    "GROUND": records.GROUND,
    "BUILDING": records.BUILDING,
    "APM_LAYER_FLAG": records.APM_LAYER_FLAG,
    "APM_COMPRESSED_FLAG": records.APM_COMPRESSED_FLAG,
    "APM_LEVELS": records.APM_LEVELS,
    "APM_LEVELS_SHIFT": records.APM_LEVELS_SHIFT,
    "APM_MOST_CELLS": records.APM_MOST_CELLS,
}
KINDS: Final = {
    "BSM": records.BSM,
    "APM": records.APM,
    "SENSOR_DATA": records.SENSOR_DATA,
    "REQUEST": records.REQUEST,
    "NOISE": records.NOISE,
}
BODIES: Final = {f"BODY_{body.name}": body.value for body in Body}
_OUTCOMES: Final = {
    "R": "RECEIVED",
    "N": "LOST_NOISE",
    "C": "LOST_COLLISION",
    "B": "LOST_BUSY",
    "T": "LOST_TRANSMITTING",
    "U": "LOST_WEAK",
}
_FLOATS: Final = {4: "float", 8: "double"}


def records_header() -> str:
    """The text of records.h: structs, the sizes they must have, enumerations and constants."""
    structs = [_struct(name, dtype) for name, dtype in STRUCTS.items()]
    sizes = [
        f'_Static_assert(sizeof({name}) == {dtype.itemsize}, "{name}");'
        for name, dtype in STRUCTS.items()
    ]
    fates = [name.upper().replace(" ", "_") for name in records.FATES]
    return "\n".join(
        [
            "/* The Binary signals of the units, made from fmus/messages/records.py: there the",
            " * members are explained. Little-endian; a frame may start at any address, so copy",
            " * records with memcpy. The codes of bodies are made from fmus/messages/bodies.py. */",
            "#ifndef RECORDS_H",
            "#define RECORDS_H",
            "#include <stdint.h>",
            "",
            *(f"#define {name} {_constant(value)}" for name, value in CONSTANTS.items()),
            f"#define BODY_CLASSES {len(Body)}",
            f'#define BODY_CODES "{BODY_CODES}"',
            "",
            *structs,
            "",
            _enumeration(KINDS),
            _enumeration(BODIES),
            _enumeration(_numbered(fates)),
            _enumeration(_numbered([_OUTCOMES[letter] for letter in records.OUTCOMES])),
            _enumeration(_numbered([name.upper() for name in records.LINKS])),
            "",
            *sizes,
            "",
            "#endif",
            "",
        ]
    )


def _struct(name: str, dtype: np.dtype) -> str:
    members = [f"    {_member(member, dtype[member])};\n" for member in dtype.names or ()]
    return f"typedef struct {{\n{''.join(members)}}} {name};"


def _member(name: str, dtype: np.dtype) -> str:
    lengths = "".join(f"[{length}]" for length in dtype.shape)
    base = dtype.base
    if base.kind == "S":
        return f"char {name}{lengths}[{base.itemsize}]"
    if base.kind == "f":
        return f"{_FLOATS[base.itemsize]} {name}{lengths}"
    sign = "u" if base.kind == "u" else ""
    return f"{sign}int{8 * base.itemsize}_t {name}{lengths}"


def _constant(value: int) -> str:
    return f"({value})" if value < 0 else f"{value}u"


def _numbered(names: list[str]) -> Mapping[str, int]:
    return {name: number for number, name in enumerate(names)}


def _enumeration(items: Mapping[str, int]) -> str:
    return f"enum {{ {', '.join(f'{name} = {number}' for name, number in items.items())} }};"
