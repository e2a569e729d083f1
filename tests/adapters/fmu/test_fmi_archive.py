"""Archives that are refused before anything of them is unpacked or loaded."""

import stat
import struct
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

from adapters.fmi import FmuComponentType, archive
from adapters.fmi.binary import HEAD, extent, identify
from adapters.fmi.unpacked import host_folder
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream

TWICE = "is in it more than once, with different contents"
LIBRARY = f"binaries/{host_folder(3)}/lag{fmpy.sharedLibraryExtension}"


@pytest.fixture(autouse=True)
def own_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other processes, too, put folders of FMUs where temporary files go."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))


@pytest.fixture
def copy(fmu: Callable[[str], Path], tmp_path: Path) -> Path:
    """A copy of an FMU that is fine."""
    path = tmp_path / "lag.fmu"
    path.write_bytes(fmu("lag").read_bytes())
    return path


def with_entry(path: Path, name: str, data: bytes = b"x", mode: int = 0) -> Path:
    """The archive with one more entry, whose name is not touched."""
    entry = zipfile.ZipInfo("replaced")
    entry.filename = entry.orig_filename = name
    entry.external_attr = mode << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(path, "a") as target:
        target.writestr(entry, data)
    return path


def with_library(path: Path, data: bytes) -> Path:
    """The FMU with another library for this machine."""
    changed = path.with_name("changed.fmu")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            new.writestr(name, data if name == LIBRARY else old.read(name))
    return changed


def refusal(path: Path) -> str:
    """Why the archive at `path` is refused, without its name."""
    before = unpacked()
    with pytest.raises(ComponentTypeError) as caught:
        FmuComponentType(path)
    assert unpacked() == before
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    return text.removeprefix(f"{path}: ")


def unpacked() -> set[Path]:
    return set(Path(tempfile.gettempdir()).glob("nlosim-*"))


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("../evil", "`../evil` leaves the folder it is unpacked to"),
        ("resources/../../evil", "`resources/../../evil` leaves the folder it is unpacked to"),
        ("resources\\..\\evil", "`resources\\..\\evil` leaves the folder it is unpacked to"),
        ("/etc/evil", "`/etc/evil` is an absolute name"),
        ("\\\\server\\evil", "`\\\\server\\evil` is an absolute name"),
        ("C:/evil", "`C:/evil` is an absolute name"),
        (
            "resources\\evil",
            "`resources\\evil` has a character that names in an FMU cannot have",
        ),
        ("resources/a:b", "`resources/a:b` has a character that names in an FMU cannot have"),
        ("", "`` has a character that names in an FMU cannot have"),
        ("a\nb", "`a\\nb` has a character that names in an FMU cannot have"),
    ],
)
def test_names_that_are_refused(copy: Path, name: str, why: str) -> None:
    assert refusal(with_entry(copy, name)) == f"is refused: {why}"


@pytest.mark.parametrize("name", ["resources/..data", "resources/a..b", "resources/ä b.csv"])
def test_names_that_only_look_like_it(copy: Path, name: str) -> None:
    FmuComponentType(with_entry(copy, name))


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices(copy: Path, kind: int) -> None:
    text = refusal(with_entry(copy, "resources/passwd", b"/etc/passwd", kind | 0o777))
    assert text == "is refused: `resources/passwd` is a link or a device, no file"


def test_files_with_modes_are_fine(copy: Path) -> None:
    FmuComponentType(with_entry(copy, "resources/tool", mode=stat.S_IFREG | 0o755))


@pytest.mark.parametrize("again", ["resources/map", "resources//map", "./resources/map"])
def test_files_that_overwrite_each_other(copy: Path, again: str) -> None:
    with_entry(copy, "resources/map")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python's module sees some of them, too
        with_entry(copy, again, b"y")
    assert refusal(copy) == f"is refused: `resources/map` {TWICE}"


def with_both(copy: Path, first: bytes, second: bytes) -> Path:
    """The archive with two files of one name."""
    with_entry(copy, "resources/map", first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return with_entry(copy, "resources/map", second)


def test_equal_files_of_one_name_are_fine(copy: Path) -> None:
    """So Reference FMUs come that list a folder twice, `Roberts` for one."""
    component = FmuComponentType(with_both(copy, b"same", b"same")).create("lag", {})
    component.setup(0, stream(1, "lag"))
    (resources,) = Path(tempfile.gettempdir()).glob("nlosim-*/**/resources")
    assert (resources / "map").read_bytes() == b"same"
    component.close()


def test_files_that_only_seem_to_be_equal(copy: Path) -> None:
    """CRC-32 does not notice a change that is its own polynomial."""
    first, second = bytes(8), bytes.fromhex("802083b8ed000000")
    assert zlib.crc32(first) == zlib.crc32(second)
    assert refusal(with_both(copy, first, second)) == f"is refused: `resources/map` {TWICE}"


def test_equal_files_are_not_compared_where_they_are_too_large(copy: Path) -> None:
    claiming(with_both(copy, b"same", b"same"), 3_000_000_000)
    assert refusal(copy).startswith(f"is refused: `resources/map` {TWICE}; it unpacks to 300")


def test_a_copy_that_is_damaged_is_none(copy: Path) -> None:
    data = bytearray(with_both(copy, b"same" * 9, b"same" * 9).read_bytes())
    start = data.index(b"resources/map") + len("resources/map")
    data[start : start + 3] = b"\xff\xff\xff"
    copy.write_bytes(data)
    assert refusal(copy) == f"is refused: `resources/map` {TWICE}"


def test_encrypted_entries(copy: Path) -> None:
    """Bit 0 of the flags in the directory (APPNOTE 6.3.10, 4.4.4)."""
    with_entry(copy, "resources/secret")
    data = bytearray(copy.read_bytes())
    start = data.rindex(b"PK\x01\x02")
    data[start + 8] |= 1
    copy.write_bytes(data)
    assert refusal(copy) == "is refused: `resources/secret` is encrypted"


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2, zipfile.ZIP_DEFLATED])
def test_a_description_that_is_damaged(copy: Path, tmp_path: Path, method: int) -> None:
    """Each method has errors of its own."""
    with zipfile.ZipFile(copy) as source:
        content = source.read("modelDescription.xml")
    path = tmp_path / "damaged.fmu"
    with zipfile.ZipFile(path, "w", method) as target:
        target.writestr("modelDescription.xml", content)
    data = bytearray(path.read_bytes())
    start = data.index(b"modelDescription.xml") + len("modelDescription.xml")
    data[start + 12 : start + 60] = bytes(48)
    path.write_bytes(data)
    assert refusal(path).startswith("cannot be read: ")


def test_a_method_that_is_not_supported(copy: Path) -> None:
    """Deflate64 is method 9 (APPNOTE 6.3.10, 4.4.5)."""
    with_entry(copy, "resources/odd")
    data = bytearray(copy.read_bytes())
    start = data.rindex(b"PK\x01\x02")
    data[start + 10] = 9
    copy.write_bytes(data)
    why = "`resources/odd` is compressed by a method that is not supported"
    assert refusal(copy) == f"is refused: {why}"


def claiming(copy: Path, size: int) -> Path:
    """The archive with a directory that says that its last entry unpacks to `size` bytes."""
    with_entry(copy, "resources/zeros", bytes(1000))
    data = bytearray(copy.read_bytes())
    struct.pack_into("<I", data, data.rindex(b"PK\x01\x02") + 24, size)
    copy.write_bytes(data)
    return copy


def test_an_archive_that_grows_too_much(copy: Path) -> None:
    text = refusal(claiming(copy, 3_000_000_000))
    assert text.startswith("is refused: it unpacks to 300")
    assert text.endswith(f" bytes, more than 250 times its own {copy.stat().st_size}")


def test_a_small_one_may_grow_as_it_likes(copy: Path) -> None:
    assert copy.stat().st_size * archive.MOST_GROWTH < 200 << 20
    FmuComponentType(claiming(copy, 200 << 20))


def test_an_archive_that_is_too_large(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with_entry(copy, "resources/zeros", bytes(100_000))
    with zipfile.ZipFile(copy) as target:
        total = sum(entry.file_size for entry in target.infolist())
        count = len(target.infolist())
    monkeypatch.setattr(archive, "MOST_BYTES", total)
    monkeypatch.setattr(archive, "MOST_FILES", count)
    FmuComponentType(copy)
    monkeypatch.setattr(archive, "MOST_BYTES", total - 1)
    monkeypatch.setattr(archive, "MOST_FILES", count - 1)
    assert refusal(copy) == (
        f"is refused: it has {count} entries, more than {count - 1}; "
        f"it unpacks to {total} bytes, more than {total - 1}"
    )


def test_a_lie_about_the_size_ends_the_reading(copy: Path) -> None:
    """What is more than the directory says is not unpacked."""
    component = FmuComponentType(claiming(copy, 10)).create("lag", {})
    with pytest.raises(ComponentTypeError, match="cannot be unpacked: Bad CRC-32"):
        component.setup(0, stream(1, "lag"))


def test_all_problems_are_said_at_once_and_check_and_run_refuse(
    copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in range(7):
        with_entry(copy, f"../evil{number}")
    with_entry(copy, "/etc/evil")
    with_entry(copy, "resources/passwd", b"/etc/passwd", stat.S_IFLNK)
    scenario = tmp_path / "two.yaml"
    scenario.write_text(
        "schema: 1\ntitle: Two\ntime: {stop: 1 s}\ncomponents:\n"
        "  a: {fmu: lag.fmu, step: 1 s}\n  b: {fmu: text.fmu, step: 1 s}\n"
    )
    (tmp_path / "text.fmu").write_text("hello")
    expected = [
        (
            f"{scenario}:5:12: components.a.fmu: {copy}: is refused: `../evil0`, `../evil1`, "
            "`../evil2`, `../evil3`, `../evil4` (and 2 more) leaves the folder it is unpacked to; "
            "`/etc/evil` is an absolute name; `resources/passwd` is a link or a device, no file"
        ),
        (
            f"{scenario}:6:12: components.b.fmu: {tmp_path / 'text.fmu'}: is no ZIP archive, so no "
            "FMU (File is not a zip file)"
        ),
    ]
    assert main(["check", str(scenario)]) == 2
    assert capsys.readouterr().out.splitlines() == expected
    assert main(["run", str(scenario), "--out", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err
    assert [line for line in expected if line not in said] == []


def elf(machine: int, kind: int = 3, *, big: bool = False) -> bytes:
    order = ">" if big else "<"
    ident = b"\x7fELF\x02" + (b"\x02" if big else b"\x01") + bytes(10)
    return ident + struct.pack(f"{order}HH", kind, machine) + bytes(100)


def pe(machine: int) -> bytes:
    return (
        b"MZ"
        + bytes(58)
        + struct.pack("<I", 128)
        + bytes(64)
        + b"PE\0\0"
        + struct.pack("<H", machine)
    )


def universal(*machines: int) -> bytes:
    slices = b"".join(struct.pack(">I16x", machine) for machine in machines)
    return b"\xca\xfe\xba\xbe" + struct.pack(">I", len(machines)) + slices


@pytest.mark.parametrize(
    ("head", "what", "platforms"),
    [
        (elf(62), "ELF for x86_64", {"x86_64-linux"}),
        (elf(183), "ELF for aarch64", {"aarch64-linux"}),
        (elf(3), "ELF for x86", {"x86-linux"}),
        (elf(21, big=True), "ELF for ppc64", set()),
        (elf(0x1234), "ELF for machine 0x1234", set()),
        (pe(0x8664), "PE for x86_64", {"x86_64-windows"}),
        (pe(0x14C), "PE for x86", {"x86-windows"}),
        (b"\xcf\xfa\xed\xfe\x0c\0\0\x01", "Mach-O for aarch64", {"aarch64-darwin"}),
        (
            universal(0x1000007, 0x100000C),
            "Mach-O for x86_64 and aarch64",
            {"x86_64-darwin", "aarch64-darwin"},
        ),
    ],
)
def test_what_a_library_is_for(head: bytes, what: str, platforms: set[str]) -> None:
    found = identify(head)
    assert found is not None
    assert str(found) == what
    systems = [f"{a}-{s}" for a in ("x86", "x86_64", "aarch64") for s in SYSTEMS]
    assert {platform for platform in systems if found.runs_on(platform)} == platforms


SYSTEMS = ("linux", "windows", "darwin")


@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"hello",
        b"\x7fELF",
        elf(62, kind=1),  # an object file
        elf(62, kind=2),  # a program
        b"MZ" + bytes(100),
        b"MZ" + bytes(58) + b"\xff\xff\xff\xff",
        b"\xca\xfe\xba\xbe\x00\x00\x00\x34" + bytes(2000),  # a class of Java
    ],
)
def test_what_is_no_library(head: bytes) -> None:
    assert identify(head) is None


@pytest.mark.skipif(fmpy.platform_tuple != "x86_64-linux", reason="names what Linux needs")
@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (elf(183), "ELF for aarch64"),
        (elf(3), "ELF for x86"),
        (pe(0x8664), "PE for x86_64"),
        (b"no library", "no shared library"),
    ],
)
def test_a_binary_for_another_machine_is_named(copy: Path, data: bytes, kind: str) -> None:
    assert refusal(with_library(copy, data)) == (
        f"`{LIBRARY}` cannot be loaded: it is {kind}, needed is ELF for x86_64"
    )


@pytest.mark.skipif(fmpy.platform_tuple != "x86_64-linux", reason="reads ELF")
def test_a_library_that_was_cut_is_refused_before_it_kills_the_process(copy: Path) -> None:
    """At the last byte that is loaded, and not one later: what follows are names for debuggers."""
    with zipfile.ZipFile(copy) as archive:
        whole = archive.read(LIBRARY)
    loaded = extent(whole[:HEAD])
    assert len(whole) // 2 < loaded <= len(whole)
    for size in (HEAD, len(whole) // 2, loaded - 1):
        assert refusal(with_library(copy, whole[:size])) == (
            f"`{LIBRARY}` cannot be loaded: it was cut, and has {size} bytes of at least {loaded}"
        )
    FmuComponentType(with_library(copy, whole[:loaded]))
