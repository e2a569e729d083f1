"""The table of message sizes says what `encode` makes."""

from dataclasses import replace

import numpy as np
import pytest

from fmus.messages.apm import encode
from fmus.messages.records import APM_LAYER_CELL
from studies.red_light.apm_sizes import COLUMNS, row
from tests.fmus.messages.apm.apms import plain


def test_a_row_has_the_sizes_of_the_messages() -> None:
    layer = np.zeros((30, 20), APM_LAYER_CELL)
    one = replace(plain(30, 20), layer=layer, cells=np.zeros((30, 20), np.uint32))
    other = replace(one, cells=np.full((30, 20), 500, np.uint32))
    assert len(encode(one, compressed=True)) == 72 + 19  # 600 cells, 32 in a byte
    assert len(encode(other, compressed=True)) == 72 + 1200 + 5  # of the layer 128 in a byte
    found = row([one, other, other])
    assert " | ".join(found) == "30 x 20 | 2472 | 4872 | 1272, 1272 | 1277, 1277 | 4 to 1"
    assert len(found) == len(COLUMNS)


def test_a_row_of_shares_says_their_levels() -> None:
    layer = np.zeros((30, 20), APM_LAYER_CELL)
    cells = np.full((30, 20), 3, np.uint32)
    apm = replace(plain(30, 20), layer=layer, cells=cells, levels=3)
    size = len(encode(apm, compressed=True))
    bare = len(encode(replace(apm, layer=None), compressed=True))
    expected = f"30 x 20, 3 levels | 2472 | 4872 | {bare}, {bare} | {size}, {size} | 4 to 1"
    assert " | ".join(row([apm])) == expected


def test_matrices_that_do_not_belong_together_are_refused() -> None:
    layer = np.zeros((2, 3), APM_LAYER_CELL)
    good = replace(plain(2, 3), layer=layer)
    other = [plain(2, 3), replace(plain(3, 2), layer=layer.T), replace(good, levels=5)]
    for bad in ([], *([good, one] for one in other)):
        with pytest.raises(ValueError, match="of one size and have layers"):
            row(bad)
