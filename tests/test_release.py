"""A release, in a repository made for the test; nothing is built but an empty file."""

import json
import subprocess
import zipfile
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import pytest

import release
from fmus.native.targets import TARGETS
from release import ReleaseError, Steps, main

CHANGELOG = """\
# Changelog

## [Unreleased]

### Added

- A thing.

## [0.1.0] - 2026-01-01

- The beginning.
"""


def git(root: Path, *arguments: str) -> str:
    identity = ("-c", "user.name=T", "-c", "user.email=t@example.org")
    command = ["git", *identity, *arguments]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A clean repository at version 0.1.0 with one unreleased entry."""
    root = tmp_path / "repository"
    root.mkdir()
    git(root, "init", "--quiet")
    for key, value in (("user.name", "T"), ("user.email", "t@example.org")):
        git(root, "config", key, value)
    (root / "pyproject.toml").write_text('[project]\nname = "nlosim"\nversion = "0.1.0"\n')
    (root / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.1.0\n")
    (root / "CHANGELOG.md").write_text(CHANGELOG)
    (root / ".gitignore").write_text("dist/\n")
    git(root, "add", "--all")
    git(root, "commit", "--quiet", "--message", "The beginning")
    return root


class Recorded:
    """Steps that only note what was asked for."""

    def __init__(self, *, fails: bool = False) -> None:
        self.fails = fails
        self.luck = ""
        self.published: list[str] = []
        self.tried: list[str] = []

    def build(self, root: Path, version: str) -> list[Path]:
        assert f'version = "{version}"' in (root / "pyproject.toml").read_text()
        made = root / "dist" / f"nlosim-{version}.tar.gz"
        made.parent.mkdir(exist_ok=True)
        made.write_text((root / "CHANGELOG.md").read_text() + self.luck)
        return [made]

    def try_out(self, made: Sequence[Path]) -> list[Path]:
        if self.fails:
            raise ReleaseError("the wheel does not run")
        self.tried += [path.name for path in made]
        bill = made[0].with_name("bill.cdx.json")
        bill.write_text("{}")
        return [bill]

    def publish(self, root: Path, tag: str, made: Sequence[Path]) -> None:
        self.published.append(tag)

    def steps(self) -> Steps:
        return Steps(build=self.build, try_out=self.try_out, publish=self.publish)


def test_a_release_sets_dates_tries_commits_and_tags(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = Recorded()
    assert main(["0.2.0"], repository, recorded.steps()) == 0
    assert recorded.tried == ["nlosim-0.2.0.tar.gz"]
    assert recorded.published == []
    assert release.PROJECT.read(repository) == release.CITATION.read(repository) == "0.2.0"
    changelog = (repository / "CHANGELOG.md").read_text()
    assert release.entries(changelog, "## [Unreleased]") == []
    assert release.entries(changelog, "## [0.2.0] - 20") == ["- A thing."]
    assert git(repository, "status", "--porcelain") == ""
    assert git(repository, "log", "-1", "--format=%s %D").startswith("Version 0.2.0 ")
    assert git(repository, "describe").strip() == "v0.2.0"
    out = capsys.readouterr().out
    assert "git push origin HEAD v0.2.0" in out
    assert "twine upload dist/nlosim-0.2.0.tar.gz" in out


def test_only_on_demand_it_leaves_the_machine(repository: Path) -> None:
    recorded = Recorded()
    assert main(["0.2.0", "--publish"], repository, recorded.steps()) == 0
    assert recorded.published == ["v0.2.0"]


def test_a_dry_run_changes_nothing(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = git(repository, "rev-parse", "HEAD")
    recorded = Recorded()
    assert main(["0.2.0", "--dry-run"], repository, recorded.steps()) == 0
    assert capsys.readouterr().out.startswith("0.2.0 would replace 0.1.0")
    assert recorded.tried == []
    assert git(repository, "rev-parse", "HEAD") == before
    assert git(repository, "status", "--porcelain") == git(repository, "tag") == ""


def test_what_is_prepared_is_only_tagged(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    release.plan(repository, "0.2.0").prepare(date(2026, 2, 3))
    git(repository, "commit", "--quiet", "--all", "--message", "Prepared")
    before = git(repository, "rev-parse", "HEAD")
    assert main(["0.2.0", "--dry-run"], repository, Recorded().steps()) == 0
    assert "0.2.0 is set already" in capsys.readouterr().out
    assert main(["0.2.0"], repository, Recorded().steps()) == 0
    assert git(repository, "rev-parse", "v0.2.0^{}") == before


def test_after_a_failure_the_repository_is_as_it_was(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["0.2.0"], repository, Recorded(fails=True).steps()) == 2
    assert capsys.readouterr().err == "error: the wheel does not run\n"
    assert release.PROJECT.read(repository) == "0.1.0"
    assert git(repository, "status", "--porcelain") == git(repository, "tag") == ""


@pytest.mark.parametrize(
    ("version", "change", "message"),
    [
        ("0.2", {}, "`0.2` is no version; write three numbers, such as 0.3.0"),
        ("0.0.9", {}, "0.0.9 is older than 0.1.0"),
        ("0.2.0", {"CITATION.cff": "version: 0.0.1\n"}, "say different versions"),
        ("0.2.0", {"CITATION.cff": "title: T\n"}, "CITATION.cff says no version"),
        ("0.2.0", {"CHANGELOG.md": "# Changelog\n"}, "has no section `## [Unreleased]`"),
        (
            "0.2.0",
            {"CHANGELOG.md": CHANGELOG.replace("- A thing.\n", "")},
            "has no entries in `## [Unreleased]`: what is new?",
        ),
        (
            "0.2.0",
            {"CHANGELOG.md": CHANGELOG + "\n## [0.2.0] - 2026-01-02\n"},
            "has a section `## [0.2.0]` already",
        ),
    ],
)
def test_what_speaks_against_a_release_is_said(
    repository: Path,
    capsys: pytest.CaptureFixture[str],
    version: str,
    change: dict[str, str],
    message: str,
) -> None:
    for name, text in change.items():
        (repository / name).write_text(text)
    git(repository, "commit", "--quiet", "--allow-empty", "--all", "--message", "Changed")
    assert main([version], repository, Recorded().steps()) == 2
    assert message in capsys.readouterr().err
    assert git(repository, "status", "--porcelain") == ""


def test_uncommitted_changes_and_a_second_time_are_refused(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (repository / "new.txt").write_text("new")
    assert main(["0.2.0"], repository, Recorded().steps()) == 2
    assert "uncommitted changes, such as `?? new.txt`" in capsys.readouterr().err
    (repository / "new.txt").unlink()
    git(repository, "tag", "v0.2.0")
    assert main(["0.2.0"], repository, Recorded().steps()) == 2
    assert "the tag v0.2.0 exists already" in capsys.readouterr().err


def wheel(path: Path, platforms: Sequence[str]) -> Path:
    """A wheel with one FMU, compiled for `platforms`."""
    with zipfile.ZipFile(path.with_suffix(".fmu"), "w") as fmu:
        for platform in platforms:
            fmu.writestr(f"binaries/{platform}/unit.so", "")
    with zipfile.ZipFile(path, "w") as files:
        files.write(path.with_suffix(".fmu"), "fmus/unit/unit.fmu")
    return path


def test_a_wheel_has_every_fmu_for_every_platform(tmp_path: Path) -> None:
    platforms = [target.platform for target in TARGETS]
    release.check_platforms(wheel(tmp_path / "all.whl", platforms))
    with pytest.raises(ReleaseError, match=f"has no library for {platforms[0]}"):
        release.check_platforms(wheel(tmp_path / "few.whl", platforms[1:]))
    with zipfile.ZipFile(tmp_path / "none.whl", "w"):
        pass
    with pytest.raises(ReleaseError, match="no FMU"):
        release.check_platforms(tmp_path / "none.whl")


def test_the_version_stands_in_two_files_that_agree() -> None:
    assert release.PROJECT.read(release.ROOT) == release.CITATION.read(release.ROOT)


def test_a_release_lists_what_it_made(repository: Path) -> None:
    assert main(["0.2.0"], repository, Recorded().steps()) == 0
    dist = repository / "dist"
    checked = subprocess.run(
        ["sha256sum", "--check", "--strict", "SHA256SUMS"],
        cwd=dist,
        capture_output=True,
        check=True,
    )
    assert checked.stdout == b"bill.cdx.json: OK\nnlosim-0.2.0.tar.gz: OK\n"


def test_a_tag_is_built_again_from_its_own_sources(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = Recorded()
    assert main(["0.2.0"], repository, recorded.steps()) == 0
    (repository / "CHANGELOG.md").write_text("what came later\n")
    capsys.readouterr()
    assert main(["0.2.0", "--again"], repository, recorded.steps()) == 0
    assert "with the same bytes: nlosim-0.2.0.tar.gz" in capsys.readouterr().out
    recorded.luck = "a time of day"
    assert main(["0.2.0", "--again"], repository, recorded.steps()) == 2
    said = capsys.readouterr().err
    assert "nlosim-0.2.0.tar.gz of v0.2.0 comes out differently: " in said
    assert main(["0.3.0", "--again"], repository, recorded.steps()) == 2
    assert "there is no tag v0.3.0" in capsys.readouterr().err
    (repository / "dist" / "SHA256SUMS").unlink()
    assert main(["0.2.0", "--again"], repository, recorded.steps()) == 2
    assert "SHA256SUMS is not there" in capsys.readouterr().err


def test_the_only_time_in_a_release_is_the_day_of_its_section(repository: Path) -> None:
    release.plan(repository, "0.2.0").prepare(date(2026, 2, 3))
    assert release.epoch(repository, "0.2.0") == 1770076800  # `date -u -d 2026-02-03 +%s`
    with pytest.raises(ReleaseError, match=r"no dated section of 0\.3\.0"):
        release.epoch(repository, "0.3.0")


def test_the_bill_of_materials_does_not_say_where_it_was_made() -> None:
    here = {"type": "distribution", "url": "file:///home/ada/dist/nlosim.whl"}
    there = {"type": "website", "url": "https://example.org"}
    bill = {
        "bomFormat": "CycloneDX",
        "components": [
            {"name": "nlosim", "externalReferences": [here]},
            {"name": "numpy", "externalReferences": [there, here]},
            {"name": "lxml"},
        ],
    }
    assert json.loads(release.without_places(json.dumps(bill))) == {
        "bomFormat": "CycloneDX",
        "components": [
            {"name": "nlosim"},
            {"name": "numpy", "externalReferences": [there]},
            {"name": "lxml"},
        ],
    }
