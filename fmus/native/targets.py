"""The platforms a native FMU is compiled for, and how.

The compiler is Zig's C compiler from PyPI (`ziglang`), which needs no system toolchain and
cross-compiles; any other C compiler works for the machine it runs on.
"""

import importlib.util
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

COMMON_FLAGS: Final = (
    "-std=c11",
    "-O3",
    "-DNDEBUG",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-fvisibility=hidden",
    "-ffp-contract=off",  # no fused multiply-add: equal results on every processor
    "-fno-math-errno",
    "-shared",
    "-s",
)
LINUX_LIBRARIES: Final = ("-lm", "-Wl,--as-needed", "-lpthread")  # threads: the channel's only
ELF_FLAGS: Final = ("-fPIC", "-Wl,-Bsymbolic", "-Wl,--build-id=none")
ZIG_FLAGS: Final = ("-fno-sanitize=undefined",)  # Zig's own default for C is to trap


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """One platform.

    Attributes:
        platform: FMI 3.0 platform tuple, the folder below `binaries/` (FMI 3.0.2, 2.5.1.4.1).
        suffix: how the names of shared libraries end.
        zig: target triple and processor, as arguments for Zig.
        flags: arguments for the compiler on this platform, on top of `COMMON_FLAGS`; `{file}` is
            the name of the library.
    """

    platform: str
    suffix: str
    zig: tuple[str, ...]
    flags: tuple[str, ...]


TARGETS: Final = (
    # x86-64-v2 is what every processor since 2009 has (SSE4.2, no AVX)
    Target(
        platform="x86_64-linux",
        suffix=".so",
        zig=("-target", "x86_64-linux-gnu.2.17", "-mcpu=x86_64_v2"),
        flags=(*ELF_FLAGS, *LINUX_LIBRARIES),
    ),
    Target(
        platform="aarch64-linux",
        suffix=".so",
        zig=("-target", "aarch64-linux-gnu.2.17"),
        flags=(*ELF_FLAGS, *LINUX_LIBRARIES),
    ),
    Target(
        platform="x86_64-windows",
        suffix=".dll",
        zig=("-target", "x86_64-windows-gnu", "-mcpu=x86_64_v2"),
        flags=(),
    ),
    Target(
        platform="aarch64-darwin",
        suffix=".dylib",
        zig=("-target", "aarch64-macos"),
        flags=("-fPIC", "-Wl,-install_name,@rpath/{file}"),  # not the temporary path
    ),
)


class CompilerError(Exception):
    """No compiler, or it refuses the sources; the message carries its output."""


def host_platform() -> str:
    """The FMI 3.0 platform tuple of this machine."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    return f"{machine}-{platform.system().lower()}"


def select_targets(names: Sequence[str]) -> tuple[Target, ...]:
    """The targets called `names`: platform tuples, `host` or `all`.

    Raises:
        CompilerError: there is no such target.
    """
    if "all" in names:
        return TARGETS
    wanted = {host_platform() if name == "host" else name for name in names}
    known = {target.platform for target in TARGETS}
    if unknown := sorted(wanted - known):
        raise CompilerError(
            f"no target `{unknown[0]}`; there are {', '.join(sorted(known))}, `host` and `all`"
        )
    return tuple(target for target in TARGETS if target.platform in wanted)


def compiler_command(target: Target, cc: Sequence[str]) -> list[str]:
    """The start of a command line that compiles for `target`.

    Args:
        target: the platform.
        cc: a compiler of the user's own, for the host only; empty for Zig.
    """
    if cc:
        if target.platform != host_platform():
            raise CompilerError(f"`{cc[0]}` compiles for this host, not for {target.platform}")
        return [*cc, *COMMON_FLAGS]
    if importlib.util.find_spec("ziglang") is None:
        raise CompilerError(
            "there is no C compiler: `pip install ziglang==0.17.0` (or `nlosim[fmu]`), "
            "or name one for this host by `--cc gcc`"
        )
    return [sys.executable, "-m", "ziglang", "cc", *target.zig, *ZIG_FLAGS, *COMMON_FLAGS]


def compiler_version(cc: Sequence[str]) -> str:
    """What identifies the compiler in the fingerprint of a build."""
    command = [*cc, "--version"] if cc else [sys.executable, "-m", "ziglang", "version"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise CompilerError(f"`{' '.join(command)}` does not run: {error}") from error
    return answer.stdout.splitlines()[0].strip()


def zig_environment() -> dict[str, str]:
    """The environment for Zig, with a cache folder that can be written."""
    environment = dict(os.environ)
    if "ZIG_GLOBAL_CACHE_DIR" not in environment:
        environment["ZIG_GLOBAL_CACHE_DIR"] = str(_cache_folder())
    environment.setdefault("ZIG_LOCAL_CACHE_DIR", environment["ZIG_GLOBAL_CACHE_DIR"])
    return environment


def _cache_folder() -> Path:
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    folder = base / "nlosim" / "zig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / "nlosim-zig"
    return folder if os.access(folder, os.W_OK) else Path(tempfile.gettempdir()) / "nlosim-zig"


def compile_library(
    target: Target,
    *,
    sources: Sequence[Path],
    include: Sequence[Path],
    system_include: Path,
    library: Path,
    flags: Sequence[str] = (),
    cc: Sequence[str] = (),
) -> None:
    """Compile C files into a shared library.

    Args:
        target: the platform of the library.
        sources: C files.
        include: folders of their headers; their names do not get into the library.
        system_include: the folder of the FMI headers.
        library: the file to be made; its folder exists.
        flags: for the compiler, besides those of the platform.
        cc: a compiler for the host instead of Zig's.

    Raises:
        CompilerError: with the compiler's messages.
    """
    command = compiler_command(target, cc)
    command += [flag for folder in include for flag in ("-I", str(folder))]
    command += ["-isystem", str(system_include)]
    command += [f"-ffile-prefix-map={folder}=." for folder in include]
    command += [*flags, *map(str, sources), "-o", str(library)]
    command += [flag.format(file=library.name) for flag in target.flags]
    answer = subprocess.run(
        command, capture_output=True, text=True, check=False, env=zig_environment()
    )
    if answer.returncode != 0:
        raise CompilerError(f"{target.platform}: {answer.stderr.strip() or answer.stdout.strip()}")
