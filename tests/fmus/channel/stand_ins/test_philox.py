"""The generator is Philox4x32-10, and a draw depends on what it decides alone."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.channel.stand_ins.philox import philox4x32, reception_draws

WORDS = st.integers(0, 2**64 - 1)


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        (
            (0xFFFFFFFF,) * 4,
            (0xFFFFFFFF,) * 2,
            (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
        ),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_known_answers_of_random123(
    counter: tuple[int, ...], key: tuple[int, int], expected: tuple[int, ...]
) -> None:
    """The lines `philox4x32 10` of the file `kat_vectors` in Random123."""
    words = np.array(counter, np.uint64)[:, None].repeat(3, axis=1)
    np.testing.assert_array_equal(philox4x32(words, key).T, [expected] * 3)


@given(WORDS, st.integers(0, 2**63 - 1), st.integers(0, 2), st.lists(st.integers(0, 2**31 - 1)))
def test_a_draw_does_not_depend_on_the_other_receivers(
    seed: int, packet: int, hop: int, receivers: list[int]
) -> None:
    together = reception_draws(seed, packet, hop, np.array(receivers, np.int64))
    alone = [float(reception_draws(seed, packet, hop, np.array([r]))[0]) for r in receivers]
    np.testing.assert_array_equal(together, alone)
    assert ((together >= 0) & (together < 1)).all()


def test_draws_are_uniform_and_differ_in_every_argument() -> None:
    receivers = np.arange(100_000)
    draws = reception_draws(1, 2, 0, receivers)
    counts = np.histogram(draws, 100, (0, 1))[0]
    chi_squared = ((counts - 1000) ** 2 / 1000).sum()
    assert chi_squared < 149  # 99 degrees of freedom: exceeded once in a thousand
    for other in [(3, 2, 0), (1, 3, 0), (1, 2, 1), (1, 2 + 2**32, 0), (1 + 2**32, 2, 0)]:
        assert abs(np.corrcoef(draws, reception_draws(*other, receivers))[0, 1]) < 0.015
