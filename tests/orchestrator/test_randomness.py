"""Random streams are independent of each other."""

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from orchestrator.randomness import stream, substream

seeds = st.integers(0, 2**63)


@given(seed=seeds, name=st.text(max_size=20))
def test_a_stream_repeats(seed: int, name: str) -> None:
    assert np.array_equal(stream(seed, name).random(4), stream(seed, name).random(4))


@given(seed=seeds, other_seed=seeds, name=st.text(max_size=20), other=st.text(max_size=20))
def test_streams_of_other_seeds_or_names_differ(
    seed: int, other_seed: int, name: str, other: str
) -> None:
    assume((seed, name) != (other_seed, other))
    assert not np.array_equal(stream(seed, name).random(4), stream(other_seed, other).random(4))


def test_streams_are_the_same_on_every_machine_and_in_every_version() -> None:
    """Published results depend on these numbers; a change needs a new major version."""
    assert stream(1, "channel").integers(0, 2**32, 3).tolist() == [
        2920864333,
        3004616106,
        3510939365,
    ]


@given(seed=seeds, name=st.text(max_size=20), part=st.text(max_size=20))
def test_the_stream_of_a_part_depends_on_its_name_and_takes_nothing(
    seed: int, name: str, part: str
) -> None:
    whole = stream(seed, name)
    first = substream(whole, part).random(4)
    assert np.array_equal(whole.random(4), stream(seed, name).random(4))
    assert np.array_equal(substream(whole, part).random(4), first)  # also when it was used
    for other in (stream(seed, name), stream(seed, name + part), substream(whole, part + "x")):
        assert not np.array_equal(other.random(4), first)


def test_streams_of_parts_are_the_same_on_every_machine_and_in_every_version() -> None:
    part = substream(stream(1, "facilities"), "second")
    assert part.integers(0, 2**32, 3).tolist() == [
        1266736215,
        2729288308,
        900610353,
    ]


def test_a_stream_without_a_seed_has_no_parts() -> None:
    keyed = np.random.Generator(np.random.Philox(key=1))
    with pytest.raises(TypeError, match="the stream has no seed; make it by `stream`"):
        substream(keyed, "a")
