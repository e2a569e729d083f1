"""Builds the compiled part of the core for each platform: the engine that steps FMUs, and planes.

It is compiled like a unit, but is no FMU: the core loads it by its place, `orchestrator.compiled`.
"""

import hashlib
import tempfile
import time
from collections.abc import Iterable, Sequence
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

FOLDER: Final = Path(__file__).parents[2] / "orchestrator" / "plan"
_SOURCES: Final = (FOLDER / "engine.c", FOLDER.parent / "recording" / "planes.c")
_HEADERS: Final = ("bytes.h", "grid.h", "mixing.h", "numbers.h")
_DIGEST: Final = ".digest"


def build_engine(
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
        begin = time.perf_counter()
        library = FOLDER / f"engine-{target.platform}{target.suffix}"
        digest = library.with_suffix(_DIGEST)
        wanted = _digest(target, cc)
        if not force and library.is_file() and digest.is_file() and digest.read_text() == wanted:
            continue
        with tempfile.TemporaryDirectory(prefix="nlosim-engine-") as name:
            made = Path(name) / library.name
            compile_library(
                target,
                sources=_SOURCES,
                include=[FOLDER],
                system_include=fmi_headers(),
                library=made,
                cc=cc,
            )
            digest.unlink(missing_ok=True)
            library.unlink(missing_ok=True)  # a running process keeps the old one
            library.write_bytes(made.read_bytes())
            digest.write_text(wanted)
        built.append((library, time.perf_counter() - begin))
    return built


def _digest(target: Target, cc: Sequence[str]) -> str:
    sources = [source_text(path).decode() for path in (*_SOURCES, *map(FOLDER.joinpath, _HEADERS))]
    parts = [*sources, compiler_version(cc), *cc, *COMMON_FLAGS, *ZIG_FLAGS]
    parts += [*target.zig, *target.flags]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
