"""What describes the project to its makers agrees with the project: CI, make, hooks, the manual."""

import json
import os
import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

import orchestrator
from fmus.native.targets import TARGETS

ROOT = Path(__file__).parents[1]
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
MAKEFILE = (ROOT / "Makefile").read_text()


def commands(job: dict[str, Any]) -> str:
    return "\n".join(step.get("run", "") for step in job["steps"])


@pytest.mark.parametrize("job", ["test", "wheel"])
def test_ci_runs_on_every_python_and_platform_that_we_name(job: str) -> None:
    matrix = WORKFLOW["jobs"][job]["strategy"]["matrix"]
    named = re.findall(r"Python :: (3\.\d+)$", "\n".join(PROJECT["classifiers"]), re.MULTILINE)
    assert matrix["python"] == named
    assert PROJECT["requires-python"] == f">={named[0]}"
    assert sorted(matrix["platform"]) == sorted(target.platform for target in TARGETS)
    assert [row["platform"] for row in matrix["include"]] == matrix["platform"]
    assert len({row["runner"] for row in matrix["include"]}) == len(TARGETS)


def test_ci_tests_builds_and_documents() -> None:
    jobs = WORKFLOW["jobs"]
    assert "make test test-slow" in commands(jobs["test"])
    assert "python -m build" in commands(jobs["build"])
    assert "nlosim run red_light" in commands(jobs["wheel"])
    assert "make docs" in commands(jobs["docs"])


def test_ci_leaves_no_test_out() -> None:
    """What `make test` leaves out is what `make test-slow` runs, and CI runs both."""
    assert re.findall(r"\$\(PYTEST\) -m ('not slow'|slow)", MAKEFILE) == ["'not slow'", "slow"]
    script = (ROOT / ".ci" / "run").read_text()
    assert re.findall(r"^make (\S+)", script, re.MULTILINE) == ["test", "test-slow"]


def test_without_make_ci_checks_the_same() -> None:
    """Each tool of `make test` is named in the steps for Windows."""
    recipe = re.search(r"^test:.*\n((?:\t.*\n)+)", MAKEFILE, re.MULTILINE)
    assert recipe
    running = re.search(r"^PYTEST = (.*)$", MAKEFILE, re.MULTILINE)
    assert running
    tools = re.findall(r"\.venv-test/bin/(\S+)", recipe[1].replace("$(PYTEST)", running[1]))
    assert {"ruff", "mypy", "lint-imports", "mkdocs", "python"} == set(tools)
    assert all(tool in commands(WORKFLOW["jobs"]["test"]) for tool in tools)


def test_every_phony_target_has_a_rule_and_says_what_it_does() -> None:
    phony = re.search(r"^\.PHONY: (.*)$", MAKEFILE, re.MULTILINE)
    assert phony
    explained = re.findall(r"^([a-z-]+):.*  ## \S", MAKEFILE, re.MULTILINE)
    assert sorted(phony[1].split()) == sorted(explained)
    listed = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert re.findall(r"^  ([a-z-]+) ", listed.stdout, re.MULTILINE) == explained


def test_what_python_compiled_is_kept_in_containers_too() -> None:
    """Many images forbid it, and the processes of a run would compile every module each."""
    shown = subprocess.run(
        ["make", "--silent", "--eval", "shown: ; @env", "shown"],
        cwd=ROOT,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONHASHSEED": "7"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "PYTHONHASHSEED=7" in shown.stdout.splitlines()
    assert "PYTHONDONTWRITEBYTECODE" not in shown.stdout


def test_every_result_is_made_again_by_a_target() -> None:
    """The commands of the targets name each experiment whose results are committed.

    With other seeds they write nothing to docs/.
    """
    targets = [
        name for name in re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE) if "paper" in name
    ]
    targets += ["apmm"]

    def commands_of(*options: str) -> str:
        command = ["make", "--dry-run", *targets, *options]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    results = sorted((ROOT / "docs" / "results").glob("*_provenance.json"))
    contents = [json.loads(path.read_text()) for path in results]
    named = {
        Path(origin["experiment"]).name
        for each in contents
        for origin in each.get("experiments", [each])
    }
    experiments = {name for name in named if name.endswith(".yaml")}
    assert len(experiments) >= 20
    whole = commands_of()
    run = set(re.findall(r"nlosim experiment studies/\w+/experiments/(\w+\.yaml)", whole))
    assert experiments <= run
    assert all(next(ROOT.glob(f"studies/*/experiments/{name}")).is_file() for name in run)
    assert "docs/results" in whole
    targets.remove("paper-sensitivity")  # one that has no quick look
    targets.remove("apmm")
    for line in commands_of("SEEDS=1..2").splitlines():
        assert not re.search(
            r" docs/(?!results/relay_runs\.csv)", line.partition("python")[2] or line
        )


def test_every_environment_is_made_by_the_one_rule_from_known_extras() -> None:
    extras = dict(re.findall(r"^EXTRAS_(\w+) = ?(.*)$", MAKEFILE, re.MULTILINE))
    assert set(re.findall(r"\.venv-([a-z]+)", MAKEFILE)) == set(extras)
    assert MAKEFILE.count("-m venv ") == 1
    for names in extras.values():
        assert set(filter(None, names.split(","))) <= set(PROJECT["optional-dependencies"])


def test_the_hooks_download_nothing() -> None:
    """They are the tools of `make test`, from its environment."""
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local"
    assert {hook["language"] for hook in repository["hooks"]} == {"system"}
    entries = {hook["entry"] for hook in repository["hooks"] if hook["types_or"] != ["c"]}
    assert all(entry.startswith(".venv-test/bin/") for entry in entries)


def test_the_reference_has_every_public_name() -> None:
    pages = "\n".join(path.read_text() for path in (ROOT / "docs" / "api").glob("*.md"))
    modules = set(re.findall(r"^::: (\S+)$", pages, re.MULTILINE))
    homes = set(orchestrator._HOMES)
    assert homes <= modules
