"""Builds native FMUs: `python -m fmus.native.build channel [lidar ...] [--target host]`.

Needs no installed package: only the sources of this repository, a C compiler (Zig's, from PyPI,
or one named by `--cc`) and the FMI headers that come with FMPy.
"""

import argparse
import hashlib
import shlex
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from typing_extensions import override

from fmus.native import archive
from fmus.native.check import InterfaceError, check_interface
from fmus.native.libraries import build_libraries
from fmus.native.targets import (
    COMMON_FLAGS,
    ZIG_FLAGS,
    CompilerError,
    Target,
    compile_library,
    compiler_version,
    select_targets,
)
from fmus.native.unit import SHELL, UNITS, Unit, fmi_headers, load_unit, source_text

_LICENCE: Final = (
    "SPDX-License-Identifier: Apache-2.0\nhttps://www.apache.org/licenses/LICENSE-2.0\n"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """What `build_fmu` did.

    Attributes:
        path: the FMU.
        seconds: of wall time.
        is_new: false if the FMU was up to date already.
    """

    path: Path
    seconds: float
    is_new: bool

    @override
    def __str__(self) -> str:
        size = self.path.stat().st_size
        what = f"{size} bytes, {self.seconds:.1f} s" if self.is_new else "up to date"
        return f"{self.path}: {what}"


def build_fmu(
    unit: Unit,
    out: Path,
    *,
    targets: Sequence[Target],
    cc: Sequence[str] = (),
    force: bool = False,
) -> Built:
    """Build `<name>.fmu` in the folder `out`, unless it is there and up to date.

    Args:
        unit: what to build.
        out: the folder for the FMU; made if it is missing.
        targets: platforms to compile for.
        cc: a compiler for the host instead of Zig's.
        force: build even if the FMU is up to date.

    Raises:
        InterfaceError: the unit's table is wrong, or a source is missing.
        CompilerError: there is no compiler, or it refuses the sources.
    """
    begin = time.perf_counter()
    check_interface(unit.interface)
    if missing := [path for path in (*unit.sources(), *unit.headers()) if not path.is_file()]:
        raise InterfaceError(f"{unit.interface.name}: {missing[0]} is missing")
    fingerprint = _fingerprint(unit, targets, cc)
    path = out / f"{unit.interface.name}.fmu"
    is_new = force or archive.read_comment(path) != fingerprint
    if is_new:
        out.mkdir(parents=True, exist_ok=True)
        files = _texts(unit) | _binaries(unit, targets, cc)
        archive.write_archive(path, files, comment=fingerprint)
    return Built(path=path, seconds=time.perf_counter() - begin, is_new=is_new)


def _fingerprint(unit: Unit, targets: Iterable[Target], cc: Sequence[str]) -> str:
    parts = [unit.token(), compiler_version(cc), *cc, *COMMON_FLAGS, *ZIG_FLAGS]
    parts += [word for t in targets for word in (t.platform, *t.zig, *t.flags)]
    parts += [source_text(path).decode() for path in sorted(SHELL.glob("*.py"))]
    parts.append(_licence().decode())
    return f"nlosim {hashlib.sha256(chr(0).join(parts).encode()).hexdigest()}"


def _texts(unit: Unit) -> dict[str, bytes]:
    interface = unit.interface
    sources = {path.name: source_text(path) for path in (*unit.sources(), *unit.headers())}
    sources |= {name: text.encode() for name, text in unit.generated().items()}
    compiled = [path.name for path in unit.sources()] + ["variables.c"]
    sources["buildDescription.xml"] = archive.build_description(interface, compiled)
    return {
        "modelDescription.xml": unit.description(),
        "documentation/index.html": archive.documentation(interface),
        "documentation/licenses/license.txt": _licence(),
        **{f"sources/{name}": text for name, text in sources.items()},
    }


def _licence() -> bytes:
    path = SHELL.parent.parent / "LICENSE"  # not there in an installed package
    return source_text(path) if path.is_file() else _LICENCE.encode()


def _binaries(unit: Unit, targets: Sequence[Target], cc: Sequence[str]) -> dict[str, bytes]:
    headers = fmi_headers()
    with tempfile.TemporaryDirectory(prefix="nlosim-fmu-") as name:
        folder = Path(name)
        unit.write_generated(folder)

        def compile_for(target: Target) -> tuple[str, bytes]:
            file = f"{unit.interface.name}{target.suffix}"
            library = folder / target.platform / file
            library.parent.mkdir()
            compile_library(
                target,
                sources=[*unit.sources(), folder / "variables.c"],
                include=[folder, unit.folder, SHELL],
                system_include=headers,
                library=library,
                cc=cc,
            )
            return f"binaries/{target.platform}/{file}", library.read_bytes()

        with ThreadPoolExecutor(max_workers=2) as pool:
            return dict(pool.map(compile_for, targets))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of a build to `parser`, for `build_units`."""
    parser.add_argument(
        "unit",
        nargs="*",
        default=UNITS,
        help=f"{', '.join(UNITS)} (default: these and the libraries that are no FMUs), or a "
        "folder with an interface.py",
    )
    parser.add_argument(
        "--target",
        action="append",
        help="a platform such as x86_64-linux, `host` or `all` (default); may be repeated",
    )
    parser.add_argument("--cc", default="", help="a C compiler for this host, e.g. gcc")
    parser.add_argument(
        "--out",
        type=Path,
        dest="folder",
        metavar="DIR",
        help="folder of the FMUs (default: their units')",
    )
    parser.add_argument("--force", action="store_true", help="build even if up to date")


def build_units(options: argparse.Namespace) -> Iterator[Built]:
    """Build the units that `options` name, one after the other.

    Raises:
        InterfaceError, CompilerError: see `build_fmu`.
    """
    cc = shlex.split(options.cc)
    targets = select_targets(options.target or (["host"] if cc else ["all"]))
    if options.unit is UNITS and options.folder is None:
        for library, seconds in build_libraries(targets, cc=cc, force=options.force):
            yield Built(path=library, seconds=seconds, is_new=True)
    for name in options.unit:
        unit = load_unit(name)
        folder = options.folder or unit.folder
        yield build_fmu(unit, folder, targets=targets, cc=cc, force=options.force)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m fmus.native.build", description=__doc__)
    add_arguments(parser)
    try:
        for built in build_units(parser.parse_args(arguments)):
            sys.stdout.write(f"{built}\n")
    except (InterfaceError, CompilerError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
