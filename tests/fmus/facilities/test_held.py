"""A held signal is built from its parts, and only when they change."""

from hypothesis import given, strategies as st

from fmus.facilities.held import HeldSignal


@given(st.lists(st.lists(st.integers(0, 3), max_size=4), max_size=12))
def test_it_is_always_the_signal_of_its_parts_and_built_once_per_change(
    history: list[list[int]],
) -> None:
    pool = [bytes([65 + k]) * 2 for k in range(4)]
    built: list[bytes] = []

    def build(parts: list[bytes]) -> bytes:
        built.append(b"".join(parts))
        return built[-1]

    held: HeldSignal[bytes] = HeldSignal(lambda parts: build(list(parts)))
    changes = 0
    for k, choice in enumerate(history):
        changes += k == 0 or choice != history[k - 1]
        assert held.of([pool[i] for i in choice]) == b"".join(pool[i] for i in choice)
    assert len(built) == changes
