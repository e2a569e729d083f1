"""The pages of the manual, from what is written for the repository to what the site needs."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

ROOT = Path(__file__).parents[1]
REPOSITORY = "https://example.org/project"


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    """docs/hooks.py, which is no part of a package."""
    spec = importlib.util.spec_from_file_location("docs_hooks", ROOT / "docs" / "hooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["docs_hooks"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("page", "target", "expected"),
    [
        ("index.md", "docs/tutorial.md#1", "tutorial.md#1"),
        ("index.md", "docs/images/red_light.png", "images/red_light.png"),
        ("index.md", "CONTRIBUTING.md", "contributing.md"),
        ("tutorial.md", "physics.md", "physics.md"),
        ("tutorial.md", "../README.md", "index.md"),
        ("decisions/index.md", "../physics.md", "../physics.md"),
        ("decisions/index.md", "../../CHANGELOG.md", "../changelog.md"),
        ("tutorial.md", "../pyproject.toml", f"{REPOSITORY}/blob/main/pyproject.toml"),
        ("tutorial.md", "../scenarios", f"{REPOSITORY}/tree/main/scenarios"),
        ("tutorial.md", "results/training", f"{REPOSITORY}/tree/main/docs/results/training"),
        ("tutorial.md", "../no/such.file", "../no/such.file"),
        ("tutorial.md", "https://example.org/a", "https://example.org/a"),
        ("tutorial.md", "#here", "#here"),
    ],
)
def test_links_lead_where_they_lead_in_the_repository(
    hooks: ModuleType, page: str, target: str, expected: str
) -> None:
    assert hooks.with_links(f"See [it]({target}).", page, REPOSITORY) == f"See [it]({expected})."


def test_code_is_left_alone(hooks: ModuleType) -> None:
    text = "`[a](../README.md)` and\n\n```\n[b](../README.md)\n```\n[c](../README.md)\n"
    expected = text.replace("[c](../README.md)", "[c](index.md)")
    assert hooks.with_links(text, "tutorial.md", REPOSITORY) == expected


def test_lists_within_lists_are_indented_by_four(hooks: ModuleType) -> None:
    text = "* a\n  b\n\n  * c\n    d\n\n1. e\n\n       code\n\nend\n  f\n```\n- g\n  h\n```\n"
    deep = (
        "* a\n    b\n\n    * c\n      d\n\n1. e\n\n        code\n\nend\n  f\n```\n- g\n  h\n```\n"
    )
    assert hooks.with_deep_lists(text) == deep


def test_formulas_become_mathml(hooks: ModuleType) -> None:
    content = (
        r'<p><span class="arithmatex">\(a &lt; b\)</span></p>'
        r'<div class="arithmatex">\[ x^2 \]</div>'
    )
    done = hooks.on_page_content(content, None, None, None)
    assert "arithmatex" not in done
    assert 'display="inline"><mrow><mi>a</mi><mo>&#x0003C;</mo><mi>b</mi>' in done
    assert 'display="block"><mrow><msup>' in done


def test_no_script_comes_from_the_net(hooks: ModuleType) -> None:
    output = '<script src="https://unpkg.com/iframe-worker/shim"></script>'
    page = SimpleNamespace(url="api/index.html")
    assert hooks.on_post_page(output, page, None) == '<script src="../assets/worker.js"></script>'
    assert (ROOT / "docs" / "assets" / "worker.js").is_file()


def test_decision_records_are_numbered_and_listed() -> None:
    folder = ROOT / "docs" / "decisions"
    records = sorted(path.name for path in folder.glob("0*.md"))
    assert [int(name[:4]) for name in records] == list(range(1, len(records) + 1))
    index = (folder / "index.md").read_text()
    for number, name in enumerate(records, 1):
        title = (folder / name).read_text().splitlines()[0].removeprefix(f"# {number}. ")
        assert f"| [{number}]({name}) | {title} |" in index
