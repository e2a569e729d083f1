"""Frames of records: what is framed is unframed, and what is no frame is refused."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages import records


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
