"""The page of figures lists every picture of the repository, and where it is shown."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")
SUFFIXES = (".svg", ".png")


def pictures() -> set[Path]:
    """All pictures that are shown or kept in `docs`."""
    return {path for path in (ROOT / "docs").rglob("*") if path.suffix in SUFFIXES}


def test_every_picture_is_listed_and_nothing_else() -> None:
    listed = {ROOT / "docs" / link for link in re.findall(r"\]\((\S+\.(?:svg|png))\)", PAGE)}
    assert listed <= pictures()
    assert {path.with_suffix("") for path in pictures()} == {
        path.with_suffix("") for path in listed
    }


def test_every_page_that_shows_a_picture_is_named() -> None:
    """In the row of the picture: a link to the page, or `README`."""
    rows = {
        (ROOT / "docs" / link).with_suffix(""): row
        for row in PAGE.splitlines()
        for link in re.findall(r"\]\((\S+\.(?:svg|png))\)", row)
    }
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    for page in pages:
        for link in re.findall(r"!\[[^\]]*\]\((\S+)\)", page.read_text(encoding="utf-8")):
            row = rows[(page.parent / link).resolve().with_suffix("")]
            assert ("README" if page.name == "README.md" else f"]({page.name})") in row
