"""Makes a release: `python release.py 0.3.0`, or `make release VERSION=0.3.0`.

Checks that nothing is uncommitted and that the changelog says what is new; sets the version, dates
the changelog's section, builds the source distribution and the wheel with the FMUs of all
platforms, runs the wheel in an empty environment, commits and tags. A version that is set and dated
already is only built, tried and tagged. Nothing leaves this machine without `--publish`.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parent
_VERSION: Final = re.compile(r"\d+\.\d+\.\d+")
_UNRELEASED: Final = "## [Unreleased]"


class ReleaseError(Exception):
    """Why there can be no release, in a sentence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A line of a file that says the version.

    Attributes:
        file: its path in the repository.
        line: a regular expression; its one group is the version.
    """

    file: str
    line: str

    def read(self, root: Path) -> str:
        """The version that the file says."""
        found = re.search(self.line, (root / self.file).read_text(encoding="utf-8"), re.MULTILINE)
        if found is None:
            raise ReleaseError(f"{self.file} says no version")
        return found[1]

    def write(self, root: Path, version: str) -> None:
        """Make the file say `version`."""
        text = (root / self.file).read_text(encoding="utf-8")
        found = re.search(self.line, text, re.MULTILINE)
        if found is None:
            raise ReleaseError(f"{self.file} says no version")
        text = text[: found.start(1)] + version + text[found.end(1) :]
        (root / self.file).write_text(text, encoding="utf-8")


PROJECT: Final = Place(file="pyproject.toml", line=r'^version = "(.+)"$')
CITATION: Final = Place(file="CITATION.cff", line=r"^version: (.+)$")
CHANGELOG: Final = "CHANGELOG.md"


def entries(changelog: str, title: str) -> list[str]:
    """What the changelog says under the heading that begins with `title`, line by line.

    Raises:
        ReleaseError: there is no such heading.
    """
    lines = changelog.splitlines()
    starts = [number for number, line in enumerate(lines) if line.startswith(title)]
    if not starts:
        raise ReleaseError(f"{CHANGELOG} has no section `{title}`")
    body = lines[starts[0] + 1 :]
    end = next((n for n, line in enumerate(body) if line.startswith("## ")), len(body))
    return [line for line in body[:end] if line.startswith("- ")]


def dated(changelog: str, version: str, day: date) -> str:
    """The changelog with what was unreleased as the section of `version`.

    Raises:
        ReleaseError: nothing is unreleased, or the version has a section already.
    """
    if f"## [{version}]" in changelog:
        raise ReleaseError(f"{CHANGELOG} has a section `## [{version}]` already")
    if not entries(changelog, _UNRELEASED):
        raise ReleaseError(f"{CHANGELOG} has no entries in `{_UNRELEASED}`: what is new?")
    return changelog.replace(_UNRELEASED, f"{_UNRELEASED}\n\n## [{version}] - {day}", 1)


def _run(*command: str | Path, cwd: Path) -> str:
    """The standard output of a command.

    Raises:
        ReleaseError: it fails.
    """
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        words = " ".join(map(str, command))
        raise ReleaseError(f"`{words}` fails:\n{done.stdout}{done.stderr}".rstrip())
    return done.stdout


def build(root: Path, version: str) -> list[Path]:
    """The source distribution, and the wheel made from it, in `dist/`."""
    _run(sys.executable, "-m", "build", "--outdir", "dist", cwd=root)
    made = [root / "dist" / f"nlosim-{version}{end}" for end in (".tar.gz", "-py3-none-any.whl")]
    if missing := [path.name for path in made if not path.is_file()]:
        raise ReleaseError(f"the build made no {missing[0]}")
    return made


def try_out(made: Sequence[Path]) -> None:
    """See that the wheel has every FMU for every platform, and runs in an empty environment."""
    wheel = made[-1]
    check_platforms(wheel)
    with tempfile.TemporaryDirectory(prefix="nlosim-release-") as name:
        folder = Path(name)
        _run(sys.executable, "-m", "venv", "env", cwd=folder)
        scripts = folder / "env" / ("Scripts" if sys.platform == "win32" else "bin")
        _run(scripts / "python", "-m", "pip", "install", "--quiet", wheel, cwd=folder)
        _run(scripts / "nlosim", "scenarios", cwd=folder)
        _run(scripts / "nlosim", "run", "red_light", "--set", "time.stop=1 s", cwd=folder)


def check_platforms(wheel: Path) -> None:
    """See that `wheel` holds FMUs, each with a library for every platform we compile for.

    Raises:
        ReleaseError: it does not.
    """
    from fmus.native.targets import TARGETS  # noqa: PLC0415 - only a release of this package has it

    with zipfile.ZipFile(wheel) as files:
        fmus = [name for name in files.namelist() if name.endswith(".fmu")]
        if not fmus:
            raise ReleaseError(f"{wheel.name} holds no FMU")
        for name in fmus:
            with files.open(name) as file, zipfile.ZipFile(file) as fmu:
                there = {Path(path).parts[1] for path in fmu.namelist() if path[:9] == "binaries/"}
            if missing := sorted({target.platform for target in TARGETS} - there):
                raise ReleaseError(f"{name} in {wheel.name} has no library for {missing[0]}")


def publish(root: Path, tag: str, made: Sequence[Path]) -> None:
    """Push the commit and its tag, and upload."""
    _run("git", "push", "origin", "HEAD", tag, cwd=root)
    _run(sys.executable, "-m", "twine", "upload", *made, cwd=root)


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """What a release does outside the repository."""

    build: Callable[[Path, str], list[Path]]
    try_out: Callable[[Sequence[Path]], None]
    publish: Callable[[Path, str, Sequence[Path]], None]


OUR_STEPS: Final = Steps(build=build, try_out=try_out, publish=publish)


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """One release, planned and checked.

    Attributes:
        root: of the repository.
        version: to come.
        before: what the files say now.
    """

    root: Path
    version: str
    before: str

    @property
    def tag(self) -> str:
        """The tag of the commit."""
        return f"v{self.version}"

    @property
    def is_prepared(self) -> bool:
        """Whether the version is set and its section dated already."""
        return self.before == self.version

    def prepare(self, day: date) -> None:
        """Set the version and date the section."""
        path = self.root / CHANGELOG
        text = dated(path.read_text(encoding="utf-8"), self.version, day)
        path.write_text(text, encoding="utf-8")
        for place in (PROJECT, CITATION):
            place.write(self.root, self.version)

    def undo(self) -> None:
        """Take back what `prepare` did; there was nothing else, since the tree was clean."""
        _run("git", "checkout", "--", CHANGELOG, PROJECT.file, CITATION.file, cwd=self.root)

    def commit(self) -> None:
        """Commit what `prepare` did, if it did anything, and tag."""
        if not self.is_prepared:
            _run("git", "commit", "--all", "--message", f"Version {self.version}", cwd=self.root)
        message = f"nlosim {self.version}"
        _run("git", "tag", "--annotate", self.tag, "--message", message, cwd=self.root)


def plan(root: Path, version: str) -> Release:
    """A release of `version`, if there can be one.

    Raises:
        ReleaseError: why not.
    """
    if not _VERSION.fullmatch(version):
        raise ReleaseError(f"`{version}` is no version; write three numbers, such as 0.3.0")
    if changed := _run("git", "status", "--porcelain", cwd=root).splitlines():
        raise ReleaseError(f"there are uncommitted changes, such as `{changed[0].strip()}`")
    before = PROJECT.read(root)
    if _numbers(version) < _numbers(before):
        raise ReleaseError(f"{version} is older than {before}, which {PROJECT.file} says")
    if CITATION.read(root) != before:
        raise ReleaseError(f"{CITATION.file} and {PROJECT.file} say different versions")
    release = Release(root=root, version=version, before=before)
    if _run("git", "tag", "--list", release.tag, cwd=root):
        raise ReleaseError(f"the tag {release.tag} exists already")
    changelog = (root / CHANGELOG).read_text(encoding="utf-8")
    if not release.is_prepared:
        dated(changelog, version, date.min)
    elif not entries(changelog, f"## [{version}] - "):
        raise ReleaseError(f"{CHANGELOG} has no entries in the section of {version}")
    return release


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def carry_out(release: Release, steps: Steps, *, is_published: bool) -> str:
    """Make the release; leaves the repository as it was if that fails.

    Returns:
        What to do next.
    """
    if not release.is_prepared:
        release.prepare(datetime.now(tz=UTC).date())
    try:
        made = steps.build(release.root, release.version)
        steps.try_out(made)
        release.commit()
    except BaseException:
        if not release.is_prepared:
            release.undo()
        raise
    if is_published:
        steps.publish(release.root, release.tag, made)
        return f"{release.tag} is published"
    files = " ".join(str(path.relative_to(release.root)) for path in made)
    return (
        f"{release.tag} is committed and tagged here. Publish it with:\n"
        f"  git push origin HEAD {release.tag}\n"
        f"  {sys.executable} -m twine upload {files}"
    )


def main(
    arguments: Sequence[str] | None = None, root: Path = ROOT, steps: Steps = OUR_STEPS
) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="release.py", description=__doc__)
    parser.add_argument("version", metavar="VERSION", help="three numbers, such as 0.3.0")
    parser.add_argument("--dry-run", action="store_true", help="only check, and say what would be")
    parser.add_argument("--publish", action="store_true", help="push the tag and upload, too")
    given = parser.parse_args(arguments)
    try:
        release = plan(root, given.version)
        if given.dry_run:
            done = "is set already" if release.is_prepared else f"would replace {release.before}"
            text = f"{given.version} {done}; it would be built, tried, and tagged {release.tag}"
        else:
            text = carry_out(release, steps, is_published=given.publish)
    except ReleaseError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    sys.stdout.write(f"{text}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
