"""Which names a pattern means."""

from fnmatch import fnmatchcase

from hypothesis import given, strategies as st

from orchestrator.patterns import meant

NAMES = st.lists(st.text("abx12[].*?", min_size=1, max_size=5), unique=True, max_size=8)


def test_a_name_with_brackets_means_itself_alone() -> None:
    assert meant("a.x[1]", ["a.x1", "a.x[1]", "a.x[2]"]) == ["a.x[1]"]
    assert meant("a.x[1]", ["a.x1", "a.x2"]) == ["a.x1"]
    assert meant("a.x*", ["a.x1", "b.x", "a.x[1]"]) == ["a.x1", "a.x[1]"]
    assert meant("a.y", ["a.x1"]) == []


@given(NAMES, st.text("abx12[].*?", min_size=1, max_size=5))
def test_every_name_can_be_said_and_all_else_is_a_pattern(names: list[str], pattern: str) -> None:
    for name in names:
        assert meant(name, names) == [name]
    if pattern not in names:
        assert meant(pattern, names) == [name for name in names if fnmatchcase(name, pattern)]
    assert meant("*", names) == (["*"] if "*" in names else names)
