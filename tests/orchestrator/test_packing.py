"""Packed values: bytes that are none are refused, whatever they are."""

import json

import pytest

from orchestrator.packing import PackingError, packed, unpacked


def framed(document: bytes) -> bytes:
    return len(document).to_bytes(8, "little") + document


@pytest.mark.parametrize(
    "content",
    [
        b"",
        framed(b"["),
        framed(b"[]"),
        framed(b'{"a":' * 100_000),
        framed(json.dumps({"value": 1, "data": 3}).encode()),
        framed(json.dumps({"value": {"at": 2}, "data": []}).encode()),
        framed(json.dumps({"value": 1, "data": [{"bytes": 0, "type": 3}]}).encode()),
        framed(
            json.dumps({"value": 1, "data": [{"bytes": 0, "type": "|O", "shape": []}]}).encode()
        ),
        framed(b'{"value": 1, "data": [{"bytes": 0, "type": {}, "shape": []}]}'),
        framed(b'{"value": 1, "data": [{"bytes": 8, "type": "i4,i4", "shape": []}]}'),
        framed(b'{"value": 1, "data": [{"bytes": 0, "type": ",", "shape": []}]}'),
        framed(b'{"value": 1, "data": [{"bytes": 8, "type": "<f8", "shape": [1e40]}]}'),
    ],
)
def test_bytes_that_are_no_packed_values_are_refused(content: bytes) -> None:
    with pytest.raises(PackingError, match="no packed values"):
        unpacked(content)


def test_what_was_packed_is_there_again() -> None:
    value = {"a": [1, None, True, 2.5, "x", b"bytes"], "b": {}}
    assert unpacked(packed(value)) == value
