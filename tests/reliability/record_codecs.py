"""What units send each other: records, abstract perception matrices, features, CPMs."""

import random
from typing import Any, Final

import numpy as np

from fmus.facilities import cpm
from fmus.messages.apm import Apm, decode, encode, join, split
from fmus.messages.features import FeaturesMessage, read_features, write_features
from fmus.messages.records import (
    APM_CELL,
    APM_LAYER_CELL,
    FEATURES,
    OBJECT,
    PACKET,
    RECEPTION,
    SENSOR,
    TRANSMISSION,
    frame,
    unframe,
)
from tests.reliability.codecs import Codec

_RECORDS: Final = {
    "LPTS": ("points", SENSOR),
    "OBJS": ("objects", OBJECT),
    "FEAT": ("heads of features", FEATURES),
    "PKTS": ("packets", PACKET),
    "RCPT": ("receptions", RECEPTION),
    "SENT": ("transmissions", TRANSMISSION),
}


def _records(magic: str, dtype: "np.dtype[Any]") -> Codec:
    def valid(rng: random.Random) -> bytes:
        count = rng.randrange(4)
        rows = np.frombuffer(rng.randbytes(count * dtype.itemsize), dtype)
        return frame(magic, rows, rng.randbytes(rng.choice((0, 0, 20))))

    return Codec(
        name=f"records: {_RECORDS[magic][0]}",
        valid=valid,
        decode=lambda data: unframe(magic, data, dtype),
        encode=lambda rows: frame(magic, rows),
        errors=(ValueError,),
    )


def _features(rng: random.Random) -> bytes:
    messages = []
    for _ in range(rng.randrange(3)):
        dimensions, count = rng.randrange(4), rng.randrange(5)
        messages.append(
            FeaturesMessage(
                vehicle=rng.randrange(99),
                time=rng.randrange(10**10),
                position=np.array([rng.random(), 2.0, 3.0]),
                heading=rng.random(),
                capacity=count + 1,
                dimensions=dimensions,
                keypoints=np.full((count, 3 + dimensions), rng.random(), np.float32),
                encoder=rng.randrange(2**64),
            )
        )
    return write_features(messages)


def _apm(rng: random.Random, levels: int) -> Apm:
    own = np.random.default_rng(rng.randrange(2**32))
    shape = rng.randrange(1, 9), rng.randrange(1, 9)
    most = levels + 1 if levels else 300
    cells = np.where(own.random(shape) < 0.5, own.integers(0, most, shape), 0).astype(APM_CELL)
    layer = None
    if rng.random() < 0.5:
        raw = own.integers(0, 256, (*shape, 4), np.uint8)
        layer = np.where(cells > 0, raw.view(APM_LAYER_CELL)[..., 0], np.zeros((), APM_LAYER_CELL))
    return Apm(
        vehicle=rng.randrange(99),
        time=rng.randrange(10**10),
        position=np.array([1.0, rng.random()]),
        heading=rng.random(),
        center=np.array([3.0, rng.random()]),
        cell=1.5,
        cells=cells,
        layer=layer,
        levels=levels,
    )


def _apms(name: str, *, levels: int, compressed: bool) -> Codec:
    return Codec(
        name=f"APMs: {name}",
        valid=lambda rng: encode(_apm(rng, levels), compressed=compressed),
        decode=decode,
        encode=lambda apm: encode(apm, compressed=compressed),
        errors=(ValueError,),
    )


def _cpm(rng: random.Random) -> bytes:
    own = np.random.default_rng(rng.randrange(2**32))
    count = rng.randrange(6)
    rows = np.zeros(count, OBJECT)
    rows["sensor"] = 20
    rows["instance"] = own.permutation(2**16)[:count]
    rows["position"] = own.uniform(-100, 100, (count, 2))
    rows["angle"] = own.uniform(0, np.pi / 2, count)
    rows["size"] = own.uniform(0, 25, (count, 2))
    rows["height"] = own.uniform(0.0, 5.0, count)
    rows["velocity"] = own.uniform(-60, 60, (count, 2))
    message = cpm.Cpm(
        station=20,
        time=rng.randrange(10**4) * 10**6,
        position=own.uniform(-300, 300, 2),
        heading=rng.uniform(-3, 3),
        objects=rows,
        ages=np.arange(count) * 5 * 10**7,
        perceived=count,
        sensor_range=rng.choice((None, 50.0)),
        segment=rng.choice((None, cpm.Segment(number=1, total=8))),
    )
    return cpm.encode(message)


def record_codecs() -> list[Codec]:
    """All of them."""
    return [
        *(_records(magic, dtype) for magic, (_, dtype) in _RECORDS.items()),
        Codec(
            name="features",
            valid=_features,
            decode=read_features,
            encode=write_features,
            errors=(ValueError,),
        ),
        Codec(
            name="APMs: several",
            valid=lambda rng: join(
                [encode(_apm(rng, 0)) for _ in range(rng.randrange(4))],
            ),
            decode=split,
            encode=join,
            errors=(ValueError,),
        ),
        _apms("of points", levels=0, compressed=False),
        _apms("of points, compressed", levels=0, compressed=True),
        _apms("of seen ground, compressed", levels=20, compressed=True),
        Codec(name="CPMs", valid=_cpm, decode=cpm.decode, errors=(cpm.CpmError,)),
    ]
