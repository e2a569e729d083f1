"""Builds the shared libraries that are no FMUs, for each platform.

engine-*            the compiled part of the core, which steps FMUs and packs planes; the core loads
                    it by its place, `orchestrator.compiled`
PLATFORM/lib*.so.*  stand-ins for libraries that SUMO's window needs, `adapters.sumo.headless`
"""

import hashlib
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fmus.native.targets import (
    COMMON_FLAGS,
    ZIG_FLAGS,
    Target,
    compile_library,
    compiler_version,
)
from fmus.native.unit import fmi_headers, source_text

_ROOT: Final = Path(__file__).parents[2]
ENGINE_FOLDER: Final = _ROOT / "orchestrator" / "plan"
"""The folder of the sources of the engine, and of what is made of them."""

_SOURCES: Final = (ENGINE_FOLDER / "engine.c", ENGINE_FOLDER.parent / "recording" / "planes.c")
_HEADERS: Final = ("bytes.h", "grid.h", "link.h", "mixing.h", "numbers.h")
_HEADLESS: Final = _ROOT / "adapters" / "sumo" / "headless"
_STAND_INS: Final[Mapping[str, str]] = {
    "libX11.so.6": "x11.h",
    "libXext.so.6": "xext.h",
    "libXrender.so.1": "xrender.h",
    "libGL.so.1": "gl.h",
    "libatomic.so.1": "atomic.h",
}
"""The file with the names of its functions, by the name of a library."""

_DIGEST: Final = ".digest"


@dataclass(frozen=True, slots=True, kw_only=True)
class Library:
    """A shared library.

    Attributes:
        path: of what is made.
        sources: C files.
        headers: that they include and that are ours.
        flags: for the compiler, besides those of the platform.
    """

    path: Path
    sources: tuple[Path, ...]
    headers: tuple[Path, ...]
    flags: tuple[str, ...] = ()


def libraries(target: Target) -> Iterator[Library]:
    """What is built for a platform, the engine first; stand-ins are for Linux."""
    yield Library(
        path=ENGINE_FOLDER / f"engine-{target.platform}{target.suffix}",
        sources=_SOURCES,
        headers=tuple(map(ENGINE_FOLDER.joinpath, _HEADERS)),
    )
    if not target.platform.endswith("-linux"):
        return
    for name, functions in _STAND_INS.items():
        yield Library(
            path=_HEADLESS / target.platform / name,
            sources=(_HEADLESS / "absent.c",),
            headers=(_HEADLESS / functions,),
            flags=(
                f'-DLIBRARY="{name}"',
                f'-DFUNCTIONS="{functions}"',
                f"-Wl,-soname,{name}",
            ),
        )


def build_libraries(
    targets: Iterable[Target], *, cc: Sequence[str] = (), force: bool = False
) -> list[tuple[Path, float]]:
    """Build the libraries that are not up to date.

    Args:
        targets: platforms to compile for.
        cc: a compiler for the host instead of Zig's.
        force: build even if up to date.

    Returns:
        The libraries that were built, and the wall time of each [s].

    Raises:
        CompilerError: there is no compiler, or it refuses the source.
    """
    built = []
    for target in targets:
        for library in libraries(target):
            begin = time.perf_counter()
            if _build(library, target, cc, force=force):
                built.append((library.path, time.perf_counter() - begin))
    return built


def _build(library: Library, target: Target, cc: Sequence[str], *, force: bool) -> bool:
    """Build a library; whether that was needed."""
    path = library.path
    digest = path.with_name(f"{path.name}{_DIGEST}")
    wanted = _digest(library, target, cc)
    if not force and path.is_file() and digest.is_file() and digest.read_text() == wanted:
        return False
    with tempfile.TemporaryDirectory(prefix="nlosim-library-") as name:
        made = Path(name) / path.name
        compile_library(
            target,
            sources=library.sources,
            include=sorted({header.parent for header in library.headers}),
            system_include=fmi_headers(),
            library=made,
            flags=library.flags,
            cc=cc,
        )
        path.parent.mkdir(exist_ok=True)
        digest.unlink(missing_ok=True)
        path.unlink(missing_ok=True)  # a running process keeps the old one
        path.write_bytes(made.read_bytes())
        digest.write_text(wanted)
    return True


def _digest(library: Library, target: Target, cc: Sequence[str]) -> str:
    sources = [source_text(path).decode() for path in (*library.sources, *library.headers)]
    parts = [*sources, compiler_version(cc), *cc, *COMMON_FLAGS, *ZIG_FLAGS]
    parts += [*target.zig, *target.flags, *library.flags]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
