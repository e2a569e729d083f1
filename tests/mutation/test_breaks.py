"""Which breaks are made of a file, and which are left out by rule."""

from pathlib import Path

import pytest

from tests.mutation.left_out import is_within, left_out
from tests.mutation.mutant import difference

SOURCE = '''\
"""Sums, 1 - 2."""
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    LEVEL = 3

@dataclass(frozen=True)
class Wagon:
    load: int | None = 4

    def __repr__(self) -> str:
        return "w" * 5

def limit(load: int | None, *, spare: int = 6) -> int | float:
    """No more than 7."""
    if load is None:
        raise ValueError(f"{8} wagons, " + str(9 - 1))
    logger.warning("%d left", 10 - load)
    text = f"{11 + load} \u00a7"; more = 12
    return min(load, spare) + 13
'''


def numbers(spans: list[tuple[tuple[int, int], tuple[int, int]]]) -> set[str]:
    """The numbers of the source that are not left out."""
    found = set()
    for number, line in enumerate(SOURCE.splitlines(), 1):
        for column, letter in enumerate(line):
            before = line[column - 1] if column else " "
            if letter.isdigit() and not before.isdigit() and not is_within((number, column), spans):
                found.add(line[column:].split()[0].strip('):,."'))
    return found


def test_texts_annotations_and_declarations_are_left_out() -> None:
    """Docstrings are no operators' business; columns count characters, not bytes."""
    assert numbers(left_out(SOURCE)) == {"1", "2", "4", "6", "7", "12", "13"}


def test_a_difference_is_of_the_lines_that_differ_only() -> None:
    old = "a\nb\nc\nd\n"
    for new, line, before, after in (
        ("a\nB\nc\nd\n", 2, "b", "B"),
        ("A\nb\nc\nd\n", 1, "a", "A"),
        ("a\nb\nx\ny\nd\n", 3, "c", "x\ny"),
        ("a\nb\nd\n", 3, "c\nd", "d"),
        ("a\na\nb\nc\nd\n", 2, "b", "a\nb"),
    ):
        found = difference("kernel", "f.py", "op", old, new)
        assert (found.line, found.before, found.after) == (line, before, after)
        assert found.applied(old) == new


class TestPython:
    """With Cosmic Ray."""

    @pytest.fixture(autouse=True)
    def _tool(self) -> None:
        pytest.importorskip("cosmic_ray", reason="needs the extra `mutation`")

    def made(self, source: str) -> dict[str, list[str]]:
        """The breaks of a source, by operator."""
        from tests.mutation import python_mutants  # noqa: PLC0415 - needs the extra

        found: dict[str, list[str]] = {}
        for choices in python_mutants.places(source).values():
            for choice in choices:
                mutant = python_mutants.made("kernel", "f.py", source, choice)
                if mutant is not None:
                    found.setdefault(choice.operator, []).append(" ".join(mutant.after.split()))
        return found

    def test_what_is_left_out_is_never_broken(self) -> None:
        broken = "\n".join(text for texts in self.made(SOURCE).values() for text in texts)
        assert "load: int | None = 5" in broken
        assert "min( spare,load)" not in broken  # says the same
        assert "max(load, spare)" in broken
        for text in ("wagons", "left", "LEVEL", "w", "int &"):
            assert not [line for line in broken.splitlines() if f'"{text}' in line]

    @pytest.mark.parametrize(
        ("source", "operator", "after"),
        [
            ("x = a + b", "ReplaceBinaryOperator_Add_Sub", ["x = a - b"]),
            ("x = a < b", "ReplaceComparisonOperator_Lt_LtE", ["x = a <= b"]),
            ("x = -a", "ReplaceUnaryOperator_Delete_USub", ["x = a"]),
            ("x = 3", "NumberReplacer", ["x = 4", "x = 2"]),
            ("f(a, b)", "SwapArguments", ["f( b,a)"]),
            ("f.add(a, b)", "SwapArguments", []),
            ("f(a, *b)", "SwapArguments", []),
            ("f(a, key=b)", "SwapArguments", []),
            ("f(a, b)", "DropStatement", ["pass"]),
            ("x.y = 1", "DropStatement", ["pass"]),
            ("x += y", "DropStatement", ["pass"]),
            ("x = 1", "DropStatement", []),
            ("def f(x):\n    if x:\n        return 1\n    return 2", "DropStatement", ["pass"]),
            ("any(a)", "SwapFunction", ["all(a)"]),
            ("a.any", "SwapFunction", []),
            ("def f(*, a): ...", "ReplaceBinaryOperator_Mul_Div", []),
            ("@override\ndef f(): ...", "RemoveDecorator", []),
            ("@property\n@abstractmethod\ndef f(): ...", "RemoveDecorator", []),
            ("@cache\ndef f(): ...", "RemoveDecorator", ["def f(): ..."]),
        ],
    )
    def test_an_operator_makes_its_breaks(
        self, source: str, operator: str, after: list[str]
    ) -> None:
        assert self.made(source + "\n").get(operator, []) == after

    def test_a_sample_is_the_same_again_and_begins_as_a_longer_one(self) -> None:
        from tests.mutation.sample import drawn  # noqa: PLC0415

        root = Path(__file__).parents[2]
        areas = ("transports", "experiments")
        short = drawn(root, 3, 6, areas)
        assert drawn(root, 3, 10, areas)[:6] == short
        assert drawn(root, 4, 6, areas) != short
        assert [each.area for each in short] == [*areas] * 3
        assert len({each.key() for each in short}) == 6
        for mutant in short:
            source = (root / mutant.file).read_text("utf-8")
            assert mutant.applied(source) != source

    def test_a_sample_is_kept_until_the_sources_change(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from tests.mutation import sample  # noqa: PLC0415

        file, path = tmp_path / "adapters" / "zenoh" / "sums.py", tmp_path / "kept.json"
        file.parent.mkdir(parents=True)
        file.write_text("x = a + 1\ny = b + 2\n")
        given = path, tmp_path, 1, 9, ["transports"]
        first = sample.kept(*given)
        assert first == sample.drawn(tmp_path, 1, 9, ["transports"]) != []
        with monkeypatch.context() as nothing:
            nothing.setattr(sample, "drawn", None)
            assert sample.kept(*given) == first
        file.write_text("x = a + 1\ny = b + 3\n")
        assert sample.kept(*given) != first

    def test_a_change_of_the_code_leaves_the_rest_of_the_sample(self, tmp_path: Path) -> None:
        from tests.mutation.sample import drawn  # noqa: PLC0415

        file = tmp_path / "adapters" / "zenoh" / "sums.py"
        file.parent.mkdir(parents=True)
        lines = [f"x{k} = a{k} + {k}" for k in range(30)]
        file.write_text("\n".join(lines))
        before = drawn(tmp_path, 1, 40, ["transports"])
        file.write_text("\n".join(["# a remark", "y = b - c", *lines[:20], *lines[21:]]))
        after = drawn(tmp_path, 1, 45, ["transports"])
        kept = [each.key() for each in before if " a20 " not in each.before]
        assert [each.key() for each in after if "b - c" not in each.before][: len(kept)] == kept


class TestC:
    """With universalmutator."""

    SOURCE = """\
#define LIMIT 3
/* a - b
   a + b */
double half(double a, double b) {
    if (a > b) return model_log(i, ERROR, "too many: %d", a - b);
    return (a - b) / 2; // a - b
}
"""

    @pytest.fixture(autouse=True)
    def _tool(self) -> None:
        pytest.importorskip("universalmutator", reason="needs the extra `mutation`")

    def test_only_lines_that_compute_are_broken(self) -> None:
        from tests.mutation import c_mutants  # noqa: PLC0415

        found = c_mutants.lines(self.SOURCE)
        assert set(found) == {6}
        texts = {" ".join(text.split()) for _, text in found[6]}
        assert "return (a + b) / 2; // a - b" in texts
        assert "return (a - b) * 2; // a - b" in texts
        assert not [text for text in texts if text.endswith("// a + b")]

    def test_the_break_of_a_line_is_applied_to_it(self) -> None:
        from tests.mutation import c_mutants  # noqa: PLC0415

        choice = next(each for each in c_mutants.lines(self.SOURCE)[6] if "(a + b)" in each[1])
        mutant = c_mutants.made("units", "half.c", self.SOURCE, 6, choice)
        assert mutant.applied(self.SOURCE) == self.SOURCE.replace("(a - b) /", "(a + b) /")
