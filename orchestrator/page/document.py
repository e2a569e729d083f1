"""A page as one file: styles, scripts, data and arrays in it, nothing from elsewhere."""

import html
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.disk import naming
from orchestrator.page.arrays import Arrays

PAGE: Final = "index.html"

WEB: Final = Path(__file__).parent / "web"
"""Scripts and styles of ours that pages share."""

LIBRARY: Final = Path(__file__).parent / "vendor"

_SAFE: Final = str.maketrans(
    {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}
)
_POLICY: Final = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
_ICON: Final = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 8'%3E"
    "%3Cpath d='M1 7V1l6 6V1' fill='none' stroke='%230072B2' stroke-width='1.4'/%3E%3C/svg%3E"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """What a page is made of.

    Attributes:
        title: of the window.
        data: what JSON can say; scripts read it from the element `data`.
        arrays: that the data refer to.
        styles: files of CSS.
        scripts: files of JavaScript, in the order in which they are run.
        licences: files of text, of the libraries among these.
    """

    title: str
    data: Mapping[str, Any]
    arrays: Arrays
    styles: Sequence[Path]
    scripts: Sequence[Path]
    licences: Sequence[Path] = ()

    def write(self, path: Path) -> None:
        """Write the page; equal contents make equal bytes.

        Raises:
            ValueError: a file would end the element that it is put into.
            OSError: the page cannot be written; it names the file.
        """
        text = self.text()
        with naming(path):
            path.write_text(text, encoding="utf-8", newline="\n")

    def text(self) -> str:
        """The page as HTML; equal contents make equal text.

        Raises:
            ValueError: a file would end the element that it is put into.
        """
        said = json.dumps(self.data, ensure_ascii=False, separators=(",", ":"))
        parts = {
            "TITLE": html.escape(self.title),
            "POLICY": f"{_POLICY}img-src data:",
            "ICON": _ICON,
            "STYLE": "\n".join(map(_text, self.styles)),
            "LICENCES": "\n\n".join(_text(path).strip() for path in self.licences),
            "DATA": said.translate(_SAFE),
            "ARRAYS": self.arrays.letters(),
            "SCRIPT": "\n".join(map(_text, self.scripts)),
        }
        return "".join(_filled(_text(WEB / "page.html"), parts))


def _filled(template: str, parts: Mapping[str, str]) -> Iterator[str]:
    """The template with its marks `{{NAME}}` replaced; what replaces them is not looked at."""
    head, *rest = template.split("{{")
    yield head
    for piece in rest:
        name, _, text = piece.partition("}}")
        yield parts[name]
        yield text


def _text(path: Path) -> str:
    """A file that is put into the page as it is.

    Raises:
        ValueError: it would end the element that it is put into.
    """
    text = path.read_text(encoding="utf-8")
    if path.suffix in {".js", ".css"} and any(w in text.lower() for w in ("</script", "</style")):
        raise ValueError(f"`{path.name}` ends the element of the page that it is part of")
    return text
