"""What MkDocs is told beyond mkdocs.yml: pages from the repository's root, links, formulas.

The manual is read in three places: in the repository, on the site, and on the site opened from
disk. Links are written for the repository; here those that leave `docs/` become pages of the site
or addresses of the repository, and formulas become MathML, which needs no script from anywhere.
"""

import html
import posixpath
import re
from pathlib import Path
from typing import Final

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT: Final = Path(__file__).parents[1]

PAGES: Final = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Files at the root of the repository that are pages of the site."""

_FOREIGN_SCRIPT: Final = "https://unpkg.com/iframe-worker/shim"
_SOURCES: Final = {page: source for source, page in PAGES.items()}
_FENCED: Final = re.compile(r"^( *)(`{3,}|~{3,}).*?^\1\2|`[^`\n]+`", re.MULTILINE | re.DOTALL)
_LINK: Final = re.compile(r"(?P<text>\]\()(?P<target>[^)#\s]+)(?P<rest>#[^)\s]*)?\)")
_MARKER: Final = re.compile(r"(?:[*+-]|\d+[.)]) +")
_FORMULA: Final = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Take in the pages that lie at the root of the repository."""
    for source, page in PAGES.items():
        files.append(File.generated(config, page, abs_src_path=str(ROOT / source)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Rewrite the links of a page that leave `docs/`, and what is within its lists."""
    del files
    repository = (config.repo_url or "").rstrip("/")
    return with_links(with_deep_lists(markdown), page.file.src_uri, repository)


def on_page_content(content: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the formulas of a page into MathML."""
    del page, config, files
    return _FORMULA.sub(_mathml, content)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Replace the one script that would come from the net by ours."""
    del config
    ours = posixpath.relpath("assets/worker.js", posixpath.dirname(page.url))
    return output.replace(_FOREIGN_SCRIPT, ours)


def with_links(markdown: str, page: str, repository: str) -> str:
    """`markdown` with links that work on the site.

    Args:
        markdown: of the page.
        page: its path below `docs/`, or what stands for it in `PAGES`.
        repository: the address of the repository, for links to files that are no pages.
    """
    source = _SOURCES.get(page, f"docs/{page}")

    def rewritten(link: re.Match[str]) -> str:
        target = _target(link["target"], source, page, repository)
        return f"{link['text']}{target}{link['rest'] or ''})"

    parts, end = [], 0
    for code in _FENCED.finditer(markdown):
        parts += [_LINK.sub(rewritten, markdown[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*parts, _LINK.sub(rewritten, markdown[end:])])


def with_deep_lists(markdown: str) -> str:
    """`markdown` with the contents of list items indented by four, as Python-Markdown wants it.

    CommonMark, which the repository shows, wants what follows the item's marker.
    """
    lines, width, is_fenced = [], 0, False
    for line in markdown.splitlines():
        is_fenced ^= line.startswith(("```", "~~~"))
        marker = None if is_fenced else _MARKER.match(line)
        if marker:
            width = len(marker[0])
        elif is_fenced or (line and line[0] != " "):
            width = 0
        is_within = not marker and width > 0 and line.startswith(" " * width)
        lines.append(" " * 4 + line[width:] if is_within else line)
    return "\n".join(lines) + "\n"


def _target(target: str, source: str, page: str, repository: str) -> str:
    """Where a link to `target` in the file `source` leads on the site, if it leads elsewhere."""
    if ":" in target:
        return target
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
    if path in PAGES:
        return posixpath.relpath(PAGES[path], posixpath.dirname(page))
    if path.startswith("docs/") and not (ROOT / path).is_dir():
        return posixpath.relpath(path.removeprefix("docs/"), posixpath.dirname(page))
    if not (ROOT / path).exists():
        return target  # broken, which the strict build says
    kind = "tree" if (ROOT / path).is_dir() else "blob"
    return f"{repository}/{kind}/main/{path}"


def _mathml(formula: re.Match[str]) -> str:
    display = "block" if formula["tag"] == "div" else "inline"
    return convert(html.unescape(formula["latex"]).strip(), display=display)
