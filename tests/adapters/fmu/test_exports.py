"""The export tables of shared libraries of all platforms, made by a compiler, and damaged."""

import struct
import subprocess
import sys

import pytest

from adapters.fmi.exports import ExportsError, exported, mach_o

SOURCE = """\
#ifdef _WIN32
#define OUT __declspec(dllexport)
#define ELSEWHERE
int __stdcall DllMainCRTStartup(void *a, unsigned b, void *c) { return 1; }
#else
#define OUT __attribute__((visibility("default")))
#define ELSEWHERE + imported()
int imported(void);
#endif
static const char *volatile said = "only_said";
static int own(void) { return 4; }
OUT int first(void) { return *said + own() ELSEWHERE; }
OUT int a_number = 3;
#ifdef __ELF__
__attribute__((visibility("protected"))) int second(void) { return 1 ELSEWHERE; }
#else
OUT int second(void) { return 1 ELSEWHERE; }
#endif
__attribute__((visibility("hidden"))) int hidden(void) { return 2; }
"""
TARGETS = {
    "x86_64-linux-gnu": {"first", "second"},
    "x86-linux-gnu": {"first", "second"},
    "powerpc64-linux-gnu": {"first", "second"},  # big-endian
    "aarch64-linux-gnu": {"first", "second"},
    "x86_64-windows-gnu": {"first", "second", "a_number"},
    "x86-windows-gnu": {"first", "second", "a_number"},
    "aarch64-macos": {"first", "second", "a_number"},
    "x86_64-macos": {"first", "second", "a_number"},
}
OF_THE_LINKER = {"__dso_handle", "_mh_dylib_header"}


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small library for each target, without a C library."""
    pytest.importorskip("ziglang", reason="needs a compiler for all platforms")
    folder = tmp_path_factory.mktemp("libraries")
    (folder / "unit.c").write_text(SOURCE)
    for target in TARGETS:
        extra = ["-Wl,-undefined,dynamic_lookup"] if "macos" in target else []
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-shared", "-nostdlib"]
        subprocess.run([*command, "-O1", *extra, "-o", target, "unit.c"], cwd=folder, check=True)
    return {target: (folder / target).read_bytes() for target in TARGETS}


def test_what_is_imported_hidden_or_only_said_is_not_exported(libraries: dict[str, bytes]) -> None:
    found = {target: exported(each) - OF_THE_LINKER for target, each in libraries.items()}
    assert found == TARGETS
    assert all(b"only_said\0" in each for each in libraries.values())


def test_a_universal_library_exports_what_all_of_its_parts_do(libraries: dict[str, bytes]) -> None:
    one, other = libraries["x86_64-macos"], libraries["aarch64-macos"]
    renamed = other.replace(b"_second", b"_secind").replace(b"second", b"secind")
    for second, expected in (
        (other, {"first", "second", "a_number"}),
        (renamed, {"first", "a_number"}),
    ):
        head = b"\xca\xfe\xba\xbe" + (2).to_bytes(4, "big")
        places = [(64, len(one)), (64 + len(one), len(second))]
        for place, length in places:
            head += b"".join(n.to_bytes(4, "big") for n in (0, 0, place, length, 0))
        binary = head.ljust(64, b"\0") + one + second
        assert exported(binary) - OF_THE_LINKER == expected


def test_older_mach_o_has_a_table_of_symbols(
    libraries: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same file, read without the trie of its exports."""
    monkeypatch.setattr(mach_o, "_DYLD_INFO", frozenset())
    monkeypatch.setattr(mach_o, "_EXPORTS_TRIE", 0)
    for target in ("aarch64-macos", "x86_64-macos"):
        assert exported(libraries[target]) - OF_THE_LINKER == {"first", "second", "a_number"}


@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "x86-windows-gnu"])
def test_a_library_without_exports_exports_nothing(
    libraries: dict[str, bytes], target: str
) -> None:
    """The directory is left out, or says that there are no names."""
    binary = libraries[target]
    (header,) = struct.unpack_from("<I", binary, 0x3C)
    entry = header + 24 + (112 if target.startswith("x86_64") else 96)
    place, length = struct.unpack_from("<II", binary, entry)
    for said in ((0, length), (place, 0), (0, 0)):
        changed = binary[:entry] + struct.pack("<II", *said) + binary[entry + 8 :]
        assert exported(changed) == frozenset()
    outside = binary[:entry] + struct.pack("<II", 0x7FFFFFFF, 40) + binary[entry + 8 :]
    with pytest.raises(ExportsError, match="exported functions is damaged: the address 0x7fff"):
        exported(outside)


def test_damaged_libraries_are_errors_and_nothing_worse(libraries: dict[str, bytes]) -> None:
    """Cut at 40 places, and with single bytes of their tables replaced."""
    told = 0
    for binary in libraries.values():
        damaged = [binary[: len(binary) * k // 40] for k in range(40)]
        places = (*range(0, 256, 5), *range(256, len(binary), len(binary) // 40))
        damaged += [binary[:k] + bytes([binary[k] ^ 0xFF]) + binary[k + 1 :] for k in places]
        for each in damaged:
            try:
                exported(each)
            except ExportsError:
                told += 1
    assert told > 40 * len(TARGETS) // 2
    with pytest.raises(ExportsError, match="it is no shared library"):
        exported(b"#!/bin/sh")
