"""Makes a release: `python release.py 0.3.0`, or `make release VERSION=0.3.0`.

Checks that nothing is uncommitted and that the changelog says what is new; sets the version, dates
the changelog's section, builds the source distribution and the wheel with the FMUs of all
platforms, runs the wheel in an empty environment, writes what is in that environment (a CycloneDX
SBOM) and SHA256SUMS, commits and tags. A version that is set and dated already is only built, tried
and tagged. Nothing leaves this machine without `--publish`.

`--again` builds a release from its tag once more, anywhere, and compares the bytes.
"""

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
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
CONSTRAINTS: Final = "release-constraints.txt"
"""Versions of what builds a release; others may write other bytes."""
SUMS: Final = "SHA256SUMS"


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


def _run(*command: str | Path, cwd: Path, more: Mapping[str, str] | None = None) -> str:
    """The standard output of a command, with `more` in its environment.

    Raises:
        ReleaseError: it fails.
    """
    environment = {**os.environ, **(more or {})}
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        words = " ".join(map(str, command))
        raise ReleaseError(f"`{words}` fails:\n{done.stdout}{done.stderr}".rstrip())
    return done.stdout


def build(root: Path, version: str) -> list[Path]:
    """The source distribution, and the wheel made from it, in `dist/`.

    The same sources give the same bytes: what builds them is of one version, and the only time in
    them is the day of the changelog's section.
    """
    more = {
        "SOURCE_DATE_EPOCH": str(epoch(root, version)),
        "PIP_CONSTRAINT": str(root.absolute() / CONSTRAINTS),
        "NLOSIM_FMU_TARGETS": "all",
    }
    _run(sys.executable, "-m", "build", "--outdir", "dist", cwd=root, more=more)
    made = [root / "dist" / f"nlosim-{version}{end}" for end in (".tar.gz", "-py3-none-any.whl")]
    if missing := [path.name for path in made if not path.is_file()]:
        raise ReleaseError(f"the build made no {missing[0]}")
    return made


def epoch(root: Path, version: str) -> int:
    """The day of the section of `version`, in seconds since 1970.

    Raises:
        ReleaseError: there is none.
    """
    text = (root / CHANGELOG).read_text(encoding="utf-8")
    found = re.search(rf"^## \[{re.escape(version)}\] - (\d{{4}}-\d\d-\d\d)$", text, re.MULTILINE)
    if found is None:
        raise ReleaseError(f"{CHANGELOG} has no dated section of {version}")
    return int(datetime.fromisoformat(f"{found[1]}T00:00:00+00:00").timestamp())


def sums(made: Sequence[Path]) -> str:
    """The SHA-256 of files, as `sha256sum --check` reads them."""
    digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in made}
    return "".join(f"{digests[name]}  {name}\n" for name in sorted(digests))


def _listed(text: str) -> dict[str, str]:
    """What `sums` wrote: digests by name."""
    return {name: digest for digest, name in (line.split() for line in text.splitlines())}


def try_out(made: Sequence[Path]) -> list[Path]:
    """See that the wheel has every FMU for every platform, and runs in an empty environment.

    Returns:
        What it is made of, as `nlosim-VERSION.cdx.json`: an SBOM of that environment (CycloneDX).
    """
    wheel = made[-1]
    bill = wheel.with_name(f"{'-'.join(wheel.name.split('-')[:2])}.cdx.json")
    check_platforms(wheel)
    with tempfile.TemporaryDirectory(prefix="nlosim-release-") as name:
        folder = Path(name)
        _run(sys.executable, "-m", "venv", "env", cwd=folder)
        scripts = folder / "env" / ("Scripts" if sys.platform == "win32" else "bin")
        _run(scripts / "python", "-m", "pip", "install", "--quiet", wheel, cwd=folder)
        _run(scripts / "nlosim", "scenarios", cwd=folder)
        _run(scripts / "nlosim", "run", "red_light", "--set", "time.stop=1 s", cwd=folder)
        _run(scripts / "python", "-m", "pip", "uninstall", "--yes", "--quiet", "pip", cwd=folder)
        lister = (sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible")
        _run(*lister, "--output-file", bill, scripts / "python", cwd=folder)
    bill.write_text(without_places(bill.read_text(encoding="utf-8")), encoding="utf-8")
    return [bill]


def without_places(bill: str) -> str:
    """An SBOM that does not say where on this machine the wheel was."""
    content = json.loads(bill)
    for component in content.get("components", []):
        places = component.pop("externalReferences", [])
        kept = [each for each in places if not each["url"].startswith("file:")]
        if kept:
            component["externalReferences"] = kept
    return json.dumps(content, indent=2) + "\n"


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
    try_out: Callable[[Sequence[Path]], list[Path]]
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
        bills = steps.try_out(made)
        listed = made[0].with_name(SUMS)
        listed.parent.mkdir(exist_ok=True)
        listed.write_text(sums([path for path in (*made, *bills) if path.is_file()]))
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


def again(root: Path, version: str, steps: Steps) -> str:
    """Build the release of a tag in a folder of its own; what to say if its bytes are the same.

    Args:
        root: of the repository.
        version: that was released.
        steps: of a release.

    Raises:
        ReleaseError: there is no such tag, or a file in `dist/` is not what it builds.
    """
    tag, dist = f"v{version}", root / "dist"
    if not _run("git", "tag", "--list", tag, cwd=root):
        raise ReleaseError(f"there is no tag {tag}; `git fetch --tags` brings those of others")
    if not (dist / SUMS).is_file():
        raise ReleaseError(f"dist/{SUMS} is not there, with which to compare; it is of the release")
    said = _listed((dist / SUMS).read_text())
    with tempfile.TemporaryDirectory(prefix="nlosim-again-") as name:
        folder = Path(name) / "sources"
        folder.mkdir()
        archive = Path(name) / "sources.tar"
        _run("git", "archive", "--output", archive, tag, cwd=root)
        shutil.unpack_archive(archive, folder, filter="data")
        begin = time.monotonic()
        found = _listed(sums(steps.build(folder, version)))
    if other := [name for name in found if said.get(name) != found[name]]:
        raise ReleaseError(
            f"{other[0]} of {tag} comes out differently: {found[other[0]]}, and dist/{SUMS} says "
            f"{said.get(other[0], 'nothing')}"
        )
    took = time.monotonic() - begin
    return f"{tag} is built again in {took:.0f} s, with the same bytes: {', '.join(found)}"


def main(
    arguments: Sequence[str] | None = None, root: Path = ROOT, steps: Steps = OUR_STEPS
) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="release.py", description=__doc__)
    parser.add_argument("version", metavar="VERSION", help="three numbers, such as 0.3.0")
    parser.add_argument("--dry-run", action="store_true", help="only check, and say what would be")
    parser.add_argument("--publish", action="store_true", help="push the tag and upload, too")
    parser.add_argument(
        "--again", action="store_true", help="only build the tag once more, and compare"
    )
    given = parser.parse_args(arguments)
    try:
        if given.again:
            sys.stdout.write(f"{again(root, given.version, steps)}\n")
            return 0
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
