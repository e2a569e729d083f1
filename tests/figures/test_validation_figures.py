"""The figures of the validation pages: what they show is kept beside them, and drawn from that."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from studies.verification.channel import figures
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.link_budget import PATH_LOSS
from studies.verification.channel.reception import ERROR_RATE
from studies.verification.channel.shown import Shown
from studies.verification.drawing import write
from tests.figures.laws import drawn_by, problems

DOCS = Path(__file__).parents[2] / "docs"
FOLDER = DOCS / "validation"


@pytest.fixture(scope="module")
def shown() -> Shown:
    return Shown.read(FOLDER)


@pytest.fixture(scope="module")
def drawn(shown: Shown, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Figure]:
    """The figures by their files, drawn of what is kept in the repository."""
    names = [one.name for one in figures.drawings(shown)]
    with pytest.MonkeyPatch.context() as patch:
        found = drawn_by(
            lambda: write(figures.drawings(shown), tmp_path_factory.mktemp("drawn")), patch
        )
    return dict(zip(names, found, strict=True))


def test_every_picture_of_the_channel_is_drawn_of_what_is_kept(drawn: dict[str, Figure]) -> None:
    assert set(drawn) == {path.name for path in FOLDER.glob("*.png")}


def test_they_fulfil_the_laws_of_figures(drawn: dict[str, Figure]) -> None:
    assert {name: problems(figure) for name, figure in drawn.items() if problems(figure)} == {}


def test_what_is_kept_is_what_the_page_says(shown: Shown) -> None:
    """Cases and largest errors in the table, and the frames of the runs."""
    page = (DOCS / "validation-channel.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\S+) \| (\d+) \| (\S+)(?: dB)? \|", page, re.MULTILINE)
    table = {name.removeprefix("stack/"): (int(n), float(most)) for name, n, most in rows[:11]}
    assert {one.name: one.zeros + sum(one.counts) for one in shown.errors} == {
        name: cases for name, (cases, _) in table.items()
    }
    for one in shown.errors:
        assert (
            10 ** one.exponents[-1]
            <= table[one.name][1] * 1.05
            <= 10 ** (one.exponents[-1] + 0.25) * 1.1
        )
    for values in shown.values:
        largest = max(max(kind.error) for kind in values.kinds)
        assert largest == pytest.approx(table[values.name][1], rel=0.03)  # two digits
    for run in shown.runs:
        frames = sum(sum(one.events) for one in run.ratios)
        cases = table[run.name][0]
        assert 0.999 * cases <= frames <= cases  # bins with few frames are not shown


def test_what_is_kept_comes_back(shown: Shown, tmp_path: Path) -> None:
    shown.write(tmp_path)
    assert Shown.read(tmp_path) == shown
    assert (tmp_path / "figures.json").read_bytes() == (FOLDER / "figures.json").read_bytes()


def test_what_is_shown_of_comparisons() -> None:
    """Errors of 0, 1.5e-9 and 3e-9 dB: one none, and one in each of two quarters of a decade."""
    golden, x = np.array([50.0, 60.0, 70.0]), np.array([1.0, 1.0, 2.0])
    losses = Comparison(
        cases=3, largest=3e-9, unit="dB", tolerance=1e-6,
        series=(
            Series(label="simple", golden=golden[:1], ours=golden[:1]),
            Series(label="special_a", golden=golden[1:2], ours=golden[1:2] + 1.5e-9),
            Series(label="special_b", golden=golden[2:], ours=golden[2:] - 3e-9),
        ),
    )  # fmt: skip
    packets = Series(
        label="6 Mbit/s, packet_success", golden=golden / 100, ours=golden / 100 + 0.01, x=x
    )
    others = Series(label="6 Mbit/s, header_success", golden=golden, ours=golden, x=x)
    rates = Comparison(cases=6, largest=0.01, unit="1", tolerance=1e-9, series=(others, packets))
    found = Shown.of({PATH_LOSS: losses, ERROR_RATE: rates})
    (values,) = found.values
    assert [(kind.label, kind.golden) for kind in values.kinds] == [
        ("simple", (50.0,)), ("special cases", (60.0, 70.0)),
    ]  # fmt: skip
    assert values.kinds[1].error == pytest.approx((1.5e-9, 3e-9), rel=1e-2)
    first = found.errors[0]
    assert (first.zeros, first.counts) == (1, (1, 1))
    assert first.exponents == (-9.0, -8.75)
    (rate,) = found.rates
    assert (rate.label, rate.snir) == ("6 Mbit/s", (1.0, 2.0))
    assert rate.golden == ((0.5, 0.7), (0.6, 0.7))
    assert rate.ours == ((0.51, 0.71), (0.61, 0.71))
    assert (found.fading, found.runs) == ((), ())


def test_marks_and_lines_of_error_rates_are_golden_and_ours(
    shown: Shown, drawn: dict[str, Figure]
) -> None:
    """Of every rate two lines, longest packets first, and golden as marks where it is inside."""
    (axes,) = drawn["error-rate.png"].axes
    lines = [
        line for line in axes.lines if line.get_linestyle() == "-" and np.size(line.get_xydata())
    ]
    assert len(lines) == 2 * len(shown.rates)
    for k, rate in enumerate(shown.rates):
        for line, ours in zip(lines[2 * k : 2 * k + 2], rate.ours, strict=True):
            assert list(line.get_ydata()) == list(ours)  # type: ignore[arg-type]
    marks = [line for line in axes.lines if line.get_linestyle() == "None"]
    golden = [share for rate in shown.rates for pair in rate.golden for share in pair]
    inner = [share for share in golden if 1e-3 < share < 1 - 1e-3]
    assert sum(int(np.size(line.get_xydata())) for line in marks) == 2 * len(inner)
