"""Builds native FMUs: `python -m fmus.native.build channel [lidar ...] [--target host]`.

Needs no installed package: only the sources of this repository, a C compiler (Zig's, from PyPI,
or one named by `--cc`) and the FMI headers that come with FMPy.
"""

import argparse
import hashlib
import importlib.util
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
from fmus.native.c_table import variables_header, variables_source
from fmus.native.check import InterfaceError, check_interface
from fmus.native.interface import Interface
from fmus.native.model_description import model_description
from fmus.native.targets import (
    COMMON_FLAGS,
    ZIG_FLAGS,
    CompilerError,
    Target,
    compile_library,
    compiler_version,
    select_targets,
)

COMMON: Final = Path(__file__).parent
SHELL_SOURCES: Final = (
    "fmi3_log.c",
    "fmi3_values.c",
    "fmi3_unit.c",
    "fmi3_variables.c",
    "fmi3_state.c",
    "fmi3_unsupported.c",
    "fmi3_shell.c",
    "portable_math.c",
    "random_normal.c",
)
SHELL_HEADERS: Final = (
    "fmi3_model.h",
    "fmi3_instance.h",
    "fmi3_log.h",
    "fmi3_values.h",
    "fmi3_unit.h",
    "records.h",
    "portable_math.h",
    "random_normal.h",
)
MODEL_VERSION: Final = "0.1.0"
UNITS: Final = ("channel", "lidar", "perception")
_LICENCE: Final = (
    "SPDX-License-Identifier: Apache-2.0\nhttps://www.apache.org/licenses/LICENSE-2.0\n"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A native unit: its interface and the folder of its sources."""

    interface: Interface
    folder: Path

    def sources(self) -> list[Path]:
        """C files, the shell's first."""
        own = [self.folder / name for name in self.interface.sources]
        return [*(COMMON / name for name in SHELL_SOURCES), *own]

    def headers(self) -> list[Path]:
        """C headers, the shell's first."""
        own = [self.folder / name for name in self.interface.headers]
        return [*(COMMON / name for name in SHELL_HEADERS), *own]


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


def load_unit(name: str) -> Unit:
    """The unit called `name` of this package, or the one in the folder `name`.

    Raises:
        InterfaceError: there is no `interface.py`, or no `INTERFACE` in it.
    """
    own = COMMON.parent / name
    folder = own if (own / "interface.py").is_file() else Path(name)
    file = folder / "interface.py"
    if not file.is_file():
        raise InterfaceError(f"there is no unit `{name}`: neither {own} nor {file} is there")
    spec = importlib.util.spec_from_file_location(f"_nlosim_unit_{folder.name}", file)
    if spec is None or spec.loader is None:
        raise InterfaceError(f"{file} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    interface = getattr(module, "INTERFACE", None)
    if not isinstance(interface, Interface):
        raise InterfaceError(f"{file} defines no `INTERFACE`")
    return Unit(interface=interface, folder=folder)


def fmi_headers() -> Path:
    """The folder of the FMI 3.0 headers, inside the FMPy package.

    Raises:
        CompilerError: FMPy is not installed.
    """
    found = importlib.util.find_spec("fmpy")  # importing it would load the whole package
    if found is None or found.origin is None:
        raise CompilerError("the FMI headers come with FMPy: `pip install fmpy`")
    return Path(found.origin).parent / "c-code"


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
        out: folder of the FMU; made if it is missing.
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
    token = instantiation_token(unit)
    fingerprint = _fingerprint(token, targets, cc)
    path = out / f"{unit.interface.name}.fmu"
    is_new = force or archive.read_comment(path) != fingerprint
    if is_new:
        out.mkdir(parents=True, exist_ok=True)
        files = _texts(unit, token)
        files |= _binaries(unit, token, targets, cc)
        archive.write_archive(path, files, comment=fingerprint)
    return Built(path=path, seconds=time.perf_counter() - begin, is_new=is_new)


def instantiation_token(unit: Unit) -> str:
    """A token that changes with the interface and the sources, and with nothing else."""
    digest = hashlib.sha256(model_description(unit.interface, token="", version=MODEL_VERSION))
    for path in (*unit.sources(), *unit.headers()):
        digest.update(path.name.encode() + b"\0" + _text(path) + b"\0")
    return f"{{{digest.hexdigest()[:32]}}}"


def _text(path: Path) -> bytes:
    """A source file with the line ends of Unix, whatever git made of them here."""
    return path.read_bytes().replace(b"\r\n", b"\n")


def _fingerprint(token: str, targets: Iterable[Target], cc: Sequence[str]) -> str:
    parts = [token, compiler_version(cc), *cc, *COMMON_FLAGS, *ZIG_FLAGS]
    parts += [word for t in targets for word in (t.platform, *t.zig, *t.flags)]
    parts += [_text(path).decode() for path in sorted(COMMON.glob("*.py"))]
    parts.append(_licence().decode())
    return f"nlosim {hashlib.sha256(chr(0).join(parts).encode()).hexdigest()}"


def _texts(unit: Unit, token: str) -> dict[str, bytes]:
    interface = unit.interface
    sources = {path.name: _text(path) for path in (*unit.sources(), *unit.headers())}
    sources["variables.c"] = variables_source(interface, token).encode()
    sources["variables.h"] = variables_header(interface).encode()
    compiled = [path.name for path in unit.sources()] + ["variables.c"]
    sources["buildDescription.xml"] = archive.build_description(interface, compiled)
    return {
        "modelDescription.xml": model_description(interface, token=token, version=MODEL_VERSION),
        "documentation/index.html": archive.documentation(interface),
        "documentation/licenses/license.txt": _licence(),
        **{f"sources/{name}": text for name, text in sources.items()},
    }


def _licence() -> bytes:
    path = COMMON.parent.parent / "LICENSE"  # not there in an installed package
    return _text(path) if path.is_file() else _LICENCE.encode()


def _binaries(
    unit: Unit, token: str, targets: Sequence[Target], cc: Sequence[str]
) -> dict[str, bytes]:
    headers = fmi_headers()
    with tempfile.TemporaryDirectory(prefix="nlosim-fmu-") as name:
        folder = Path(name)
        (folder / "variables.c").write_text(variables_source(unit.interface, token))
        (folder / "variables.h").write_text(variables_header(unit.interface))

        def compile_for(target: Target) -> tuple[str, bytes]:
            file = f"{unit.interface.name}{target.suffix}"
            library = folder / target.platform / file
            library.parent.mkdir()
            compile_library(
                target,
                sources=[*unit.sources(), folder / "variables.c"],
                include=[folder, unit.folder, COMMON],
                system_include=headers,
                library=library,
                cc=cc,
            )
            return f"binaries/{target.platform}/{file}", library.read_bytes()

        with ThreadPoolExecutor(max_workers=2) as pool:
            return dict(pool.map(compile_for, targets))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of a build."""
    parser.add_argument(
        "unit",
        nargs="*",
        default=UNITS,
        help=f"{', '.join(UNITS)} (default: these), or a folder with an interface.py",
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
