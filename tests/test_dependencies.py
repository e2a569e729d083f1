"""docs/dependencies.md: every package of an installation, with licence and size."""

import re
import subprocess
import sys
from email.message import Message as PackageMessage
from importlib.metadata import PathDistribution, distribution, packages_distributions
from pathlib import Path

import pytest

import dependencies
from dependencies import BEGIN, END, OURS, extras_table, licence, normal, package, required

PAGE = Path(__file__).parents[1] / "docs" / "dependencies.md"


def made(folder: Path, fields: str) -> PathDistribution:
    """An installed package of two files, of 1000 and 24 bytes, and bytecode."""
    info = folder / "a_package-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: A_Package\nVersion: 1\n{fields}")
    (folder / "__pycache__").mkdir()
    for name, size in (("a.py", 1000), ("b.so", 24), ("__pycache__/a.pyc", 500)):
        (folder / name).write_bytes(b" " * size)
    (info / "RECORD").write_text("a.py,,\nb.so,,\n__pycache__/a.pyc,,\ngone.py,,\n")
    return PathDistribution(info)


def test_sizes_are_of_what_pip_puts_there(tmp_path: Path) -> None:
    found = package(made(tmp_path, "License-Expression: MIT\n"))
    assert (found.name, found.version, found.licence, found.size) == ("a-package", "1", "MIT", 1024)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ("License: BSD\nLicense-Expression: MIT OR GPL-2.0-only\n", "MIT OR GPL-2.0-only"),
        ("License: x\nClassifier: License :: OSI Approved :: MIT License\n", "MIT License"),
        ("License: BSD\n", "BSD"),
        (f"License: {'words ' * 20}\n", "not said"),
        ("", "not said"),
    ],
)
def test_the_licence_is_what_the_metadata_say(fields: str, said: str, tmp_path: Path) -> None:
    assert licence(made(tmp_path, fields)) == said


def test_the_base_installation_is_what_is_required_in_turn() -> None:
    base = required()
    assert {"libsumo", "sumo-data", "fmpy", "lxml", "numpy", "pydantic-core"} <= set(base)
    assert not {"nlosim", "torch", "pytest", "ruff", "pyarrow"} & set(base)
    assert base["libsumo"].size > 100e6
    assert {"torch", "pyarrow"} <= set(required("train"))  # an extra made of extras


def test_the_page_names_every_package_of_the_base_installation_with_a_licence() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([a-z0-9-]+) \| \S+ \| (.+) \| [\d.]+ \|$", text, re.MULTILINE)
    assert set(required()) <= {name for name, _ in rows}
    assert all(licence for _, licence in rows)
    total = re.search(r"^\| together \| +\| +\| ([\d.]+) \|$", text, re.MULTILINE)
    assert total is not None


def test_only_what_is_between_the_marks_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dependencies, "extras_table", lambda base, former: iter(()))
    found = dependencies.page(f"before\n{BEGIN}old\n{END}after\n")
    assert found.startswith(f"before\n{BEGIN}")
    assert found.endswith(f"{END}after\n")
    assert "old" not in found
    with pytest.raises(ValueError, match="has no"):
        dependencies.page("nothing\n")


def test_an_extra_that_is_not_installed_here_keeps_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not every one is: a viewer alone has 500 MB."""

    def requirements(name: str, extra: str) -> list[str]:
        del name
        return {"here": ["numpy"], "away": ["no-such-package"]}.get(extra, [])

    class Said:
        metadata = PackageMessage()

    Said.metadata["Provides-Extra"] = "here"
    Said.metadata["Provides-Extra"] = "away"
    Said.metadata["Provides-Extra"] = "mutation"  # for work on this package
    monkeypatch.setattr(
        dependencies, "distribution", lambda name: Said if name == OURS else distribution(name)
    )
    monkeypatch.setattr(dependencies, "_requirements", requirements)
    former = "| `away` | a-package 1 (MIT) | 500.0 |\n| `here` | old | 1.0 |\n"
    here, away = list(extras_table([], former))[2:]
    assert here.startswith("| `here` | numpy")
    assert away == "| `away` | a-package 1 (MIT) | 500.0 |"
    assert list(extras_table([]))[3] == "| `away` |  | 0.0 |"


@pytest.mark.slow
@pytest.mark.parametrize("command", [["fmu", "info"], ["fmu", "validate"]])
def test_what_only_fmpy_requires_is_not_needed(command: list[str], tmp_path: Path) -> None:
    """As docs/dependencies.md says, which tells how to be without it."""
    page = PAGE.read_text(encoding="utf-8")
    (line,) = re.findall(r"^\$ pip uninstall --yes (.*)$", page, re.MULTILINE)
    away = {normal(name) for name in line.split()}
    others = {OURS, *required()} - {"fmpy", *away}
    of_others = {name for other in others for name in needs(other)}
    assert {"cmake", "nbformat", "jinja2"} <= away <= {*required()} - of_others
    modules = {
        name for name, owners in packages_distributions().items() if {*map(normal, owners)} <= away
    }
    assert {"cmake", "nbformat", "jinja2", "lark", "msgpack"} <= modules
    script = tmp_path / "without.py"
    script.write_text(WITHOUT.format(modules=sorted(modules)))
    unit = PAGE.parents[1] / "fmus" / "channel" / "channel.fmu"
    done = subprocess.run(
        [sys.executable, str(script), *command, str(unit)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "channel" in done.stdout


WITHOUT = """\
import sys


class Away:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {modules}:
            raise ModuleNotFoundError(name)


sys.meta_path.insert(0, Away())
from orchestrator.cli import main

sys.exit(main(sys.argv[1:]))
"""


def needs(name: str) -> list[str]:
    return list(dependencies._requirements(name, ""))
