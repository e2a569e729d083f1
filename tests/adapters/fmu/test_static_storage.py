"""What proves that a library remembers nothing: some made by a compiler, and damaged."""

import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmi.static_storage import remembers_nothing

pytestmark = pytest.mark.slow

PLAIN = """\
void *calloc(unsigned long, unsigned long);
int puts(const char *);
int strcmp(const char *, const char *);
double floor(double);
const char *const names[] = {"one", "two"}; /* addresses, which the loader fills */
__attribute__((visibility("default"))) void *step(const char *a, double *x) {
    *x = floor(*x);
    return calloc(1, strcmp(a, names[*x > 1]) != 0);
}
"""
ADDED = {
    "counter": "int count(void) { static int counter; return ++counter; }",
    "byte": "char seen(void) { static char was; return was++; }",
    "initialised": "int count(void) { static int counter = 3; return ++counter; }",
    "of a thread": "int count(void) { static _Thread_local int counter; return ++counter; }",
    "constructor": "__attribute__((constructor)) void begin(void) { puts(names[0]); }",
    "destructor": "__attribute__((destructor)) void end(void) { puts(names[0]); }",
}
START_CODE = """\
static volatile char completed __asm__("completed.0");
void *volatile __dso_handle __attribute__((visibility("hidden"))) = (void *)&__dso_handle;
static void frame_dummy(void) { (void)__dso_handle; }
static void aux(void) { completed = 1; }
static void (*const begin)(void) __asm__("__frame_dummy_init_array_entry")
    __attribute__((section(".init_array"), used)) = frame_dummy;
static void (*const end)(void) __asm__("__do_global_dtors_aux_fini_array_entry")
    __attribute__((section(".fini_array"), used)) = aux;
"""
"""As it stands in the libraries of GCC, whose linker makes more of its one byte."""

Build = Callable[..., bytes]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compile files with these contents, by name, with these options."""
    pytest.importorskip("ziglang", reason="needs a compiler for all platforms")

    def built(*options: str, target: str = "x86_64-linux-gnu.2.17", **files: str) -> bytes:
        folder = tmp_path_factory.mktemp("library")
        for name, text in files.items():
            (folder / f"{name}.c").write_text(text)
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-shared", "-fPIC"]
        command += ["-O1", "-fvisibility=hidden", "-fno-sanitize=undefined", *options]
        command += ["-o", "library.so", *(f"{name}.c" for name in files)]
        subprocess.run(command, cwd=folder, check=True)
        return (folder / "library.so").read_bytes()

    return built


@pytest.fixture(scope="module")
def plain(build: Build) -> bytes:
    """A library without variables, which needs two others."""
    return build("-lm", unit=PLAIN)


def test_constants_and_addresses_of_functions_are_no_memory(build: Build, plain: bytes) -> None:
    """Filled at once or when they are first called, stripped or not, on both processors."""
    assert remembers_nothing(plain)
    assert remembers_nothing(build("-s", "-Wl,-z,lazy", unit=PLAIN))
    assert remembers_nothing(
        build("-nostdlib", "-Wl,-z,lazy", target="aarch64-linux-gnu", unit=PLAIN)
    )


def test_addresses_that_stay_writable_could_be_changed(build: Build) -> None:
    assert not remembers_nothing(build("-Wl,-z,norelro", unit=PLAIN))


@pytest.mark.parametrize("added", ADDED)
@pytest.mark.parametrize("options", [(), ("-s",)], ids=["whole", "stripped"])
def test_variables_and_code_of_its_own_at_the_beginning_are_memory(
    build: Build, added: str, options: tuple[str, ...]
) -> None:
    text = ADDED[added].replace("int count", "__attribute__((used)) int count")
    text = text.replace("char seen", "__attribute__((used)) char seen")
    assert not remembers_nothing(build(*options, unit=PLAIN + text))


def test_start_code_of_the_compiler_is_known_by_its_file(build: Build) -> None:
    """Not if the table of symbols is gone, or if a byte is somebody else's."""
    byte = ADDED["byte"].replace("char seen", "__attribute__((used)) char seen")
    proven = build(crtstuff=START_CODE, unit=PLAIN)
    assert remembers_nothing(proven)
    assert not remembers_nothing(build("-s", crtstuff=START_CODE, unit=PLAIN))
    assert not remembers_nothing(build(else_=START_CODE, unit=PLAIN))
    assert not remembers_nothing(build(crtstuff=START_CODE, unit=PLAIN + byte))
    for name in (b"__frame_dummy_init", b"__do_global_dtors_aux_fini", b"__dso_handle"):
        assert not remembers_nothing(proven.replace(name, name[::-1]))
    constructor = build(crtstuff=START_CODE, unit=PLAIN + ADDED["constructor"])
    assert not remembers_nothing(constructor)


@pytest.mark.parametrize("name", ["dladdr", "dlopen", "atexit"])
def test_functions_that_tell_copies_apart_are_not_called(plain: bytes, name: str) -> None:
    assert not remembers_nothing(plain.replace(b"calloc", name.encode()))
    assert remembers_nothing(plain.replace(b"calloc", b"malloc"))


def test_nothing_but_the_c_library_is_needed(plain: bytes) -> None:
    assert remembers_nothing(plain.replace(b"libm.so.6", b"libc.so.6"))
    for name in (b"libx.so.6", b"libm.dylb", b"./m.so.66"):
        assert not remembers_nothing(plain.replace(b"libm.so.6", name))


def _segments(library: bytes) -> dict[int, int]:
    """Places of the segments in the table, by kind; one for each."""
    count = struct.unpack_from("<H", library, 56)[0]
    places = range(64, 64 + 56 * count, 56)
    return {struct.unpack_from("<I", library, at)[0]: at for at in places}


@pytest.mark.parametrize(
    ("kind", "other"),
    [(0x6474E552, 0), (0x6474E551, 7), (2, 0)],
    ids=["nothing protected", "variables of threads", "no dynamic table"],
)
def test_segments_count(plain: bytes, kind: int, other: int) -> None:
    at = _segments(plain)[kind]
    altered = plain[:at] + struct.pack("<I", other) + plain[at + 4 :]
    assert not remembers_nothing(altered)


@pytest.mark.parametrize("tag", [12, 13, 25, 26, 32, 0x7FFFFFFD, 0x7FFFFFFF])
def test_entries_of_the_dynamic_table_count(plain: bytes, tag: int) -> None:
    """What begins, what ends, and libraries that stand in for this one."""
    place, size = (
        struct.unpack_from("<Q", plain, _segments(plain)[2] + offset)[0] for offset in (8, 32)
    )
    tags = {struct.unpack_from("<q", plain, at)[0]: at for at in range(place, place + size, 16)}
    hashes = tags[0x6FFFFEF5]
    altered = plain[:hashes] + struct.pack("<q", tag) + plain[hashes + 8 :]
    assert not remembers_nothing(altered)
    symbols = tags[6] + 8
    assert not remembers_nothing(plain[:symbols] + b"\xff" + plain[symbols + 1 :])


def test_damaged_libraries_prove_nothing_and_do_nothing_worse(plain: bytes, tmp_path: Path) -> None:
    """Cut anywhere, with the first bytes of others, and with any byte of the headers changed."""
    assert not any(remembers_nothing(plain[: len(plain) * k // 200]) for k in range(200))
    assert not remembers_nothing(b"MZ" + plain[2:])
    assert not remembers_nothing(plain[:4] + b"\x01" + plain[5:])  # for 32 bits
    assert not remembers_nothing(plain[:5] + b"\x02" + plain[6:])  # big-endian
    assert not remembers_nothing(plain[:18] + b"\x08" + plain[19:])  # another processor
    table = struct.unpack_from("<Q", plain, 40)[0]
    dynamic = struct.unpack_from("<Q", plain, _segments(plain)[2] + 8)[0]
    for k in (*range(64 + 56 * 8), *range(table, len(plain)), *range(dynamic, dynamic + 400)):
        for bits in (0xFF, 0x01):
            remembers_nothing(plain[:k] + bytes([plain[k] ^ bits]) + plain[k + 1 :])
