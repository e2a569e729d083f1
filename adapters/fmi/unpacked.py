"""An FMU on disk: unpacked for this platform, loaded, and gone again afterwards."""

import ctypes
import os
import zipfile
from pathlib import Path
from typing import Any, Final

import fmpy
import fmpy.fmi2
import fmpy.fmi3

from adapters.fmi.archive import UNREADABLE, opened
from adapters.fmi.binary import HEAD, extent, identify, needed
from adapters.fmi.description import FmuDescription
from adapters.fmi.kind import Kind
from adapters.fmi.sharing import LIBRARIES
from orchestrator.errors import ComponentTypeError
from orchestrator.scratch import discard, temporary_folder

_FMI2_PLATFORMS: Final = {
    "x86_64-linux": "linux64",
    "x86-linux": "linux32",
    "x86_64-windows": "win64",
    "x86-windows": "win32",
    "x86_64-darwin": "darwin64",
    "aarch64-darwin": "darwin64",
    "aarch64-linux": "linux64",
}


def host_folder(version: int) -> str:
    """The folder below `binaries/` for this machine, in FMI `version`."""
    tuple3: str = fmpy.platform_tuple
    return _FMI2_PLATFORMS.get(tuple3, tuple3) if version == 2 else tuple3


def check_binary(description: FmuDescription) -> None:
    """Refuse an FMU without a binary for this machine, before anything loads it.

    Raises:
        ComponentTypeError: and says which platforms it has.
    """
    folder = host_folder(description.version)
    suffix: str = fmpy.sharedLibraryExtension
    wanted = f"binaries/{folder}/{description.identifier}{suffix}"
    with opened(description.path) as archive:
        names = archive.namelist()
        if wanted in names:
            _check_platform(archive, wanted, f"{description.path}: `{wanted}`")
            return
    offered = sorted({name.split("/")[1] for name in names if name.startswith("binaries/")} - {""})
    has = f"it has binaries for {', '.join(offered)}" if offered else "it has no binaries"
    raise ComponentTypeError(
        f"{description.path}: cannot run on this machine ({folder}): {has}; `{wanted}` is missing"
    )


def _check_platform(archive: zipfile.ZipFile, name: str, what: str) -> None:
    """Refuse the library `name` if its header is not one for this machine."""
    platform: str = fmpy.platform_tuple
    try:
        with archive.open(name) as library:
            head = library.read(HEAD)
    except UNREADABLE as error:
        raise ComponentTypeError(f"{what} cannot be read: {error}") from error
    found, size = identify(head), archive.getinfo(name).file_size
    if found is not None and found.runs_on(platform):
        if size < extent(head):
            raise ComponentTypeError(
                f"{what} cannot be loaded: it was cut, and has {size} bytes of at least "
                f"{extent(head)}"
            )
        return
    kind = "no shared library" if found is None else str(found)
    raise ComponentTypeError(f"{what} cannot be loaded: it is {kind}, needed is {needed(platform)}")


class LoadedFmu:
    """The binary of an FMU, loaded from a temporary folder of its own.

    Instances of an FMU share the library in memory where it provably remembers nothing.

    Attributes:
        resources: the folder of the FMU's resources; it may be missing.
    """

    def __init__(self, description: FmuDescription, name: str) -> None:
        """Unpack and load the FMU for the instance `name`.

        Raises:
            ComponentTypeError: the archive is damaged, or the binary cannot be loaded.
        """
        self._folder = _unpack(description)
        self.resources = self._folder / "resources"
        self._functions: dict[str, Any] = {}
        binaries = self._folder / "binaries" / host_folder(description.version)
        self._library = binaries / f"{description.identifier}{fmpy.sharedLibraryExtension}"
        try:
            LIBRARIES.enter(self._library)
            self._dll = _load(description, self._folder, name).dll
        except BaseException:
            self.discard()
            raise

    def call(self, function: str, *arguments: Any) -> Any:
        """Call an FMI function with the argument types that FMPy knows; its result."""
        return getattr(self._dll, function)(*arguments)

    def function(self, name: str, arguments: tuple[Any, ...]) -> Any:
        """An FMI function that returns a status, with argument types of our own.

        Pointers can be plain addresses then, so that arrays travel without conversion.
        """
        if name not in self._functions:
            function = self._dll[name]  # a new object: FMPy's keeps its argument types
            function.argtypes = arguments
            function.restype = ctypes.c_int
            self._functions[name] = function
        return self._functions[name]

    def address_of(self, name: str) -> int:
        """Where an FMI function is; 0 if the library has none of this name."""
        try:
            function = self._dll[name]
        except AttributeError:
            return 0
        return ctypes.cast(function, ctypes.c_void_p).value or 0

    def unload(self) -> None:
        """Unload the library; nothing of it may be called any more."""
        self._functions.clear()
        fmpy.freeLibrary(self._dll._handle)  # noqa: SLF001  (as FMPy does)

    def discard(self) -> None:
        """Remove the temporary folder."""
        LIBRARIES.leave(self._library)
        discard(self._folder)


def _unpack(description: FmuDescription) -> Path:
    """Unpack what this machine needs into a new temporary folder."""
    folder = temporary_folder(description.identifier)
    own = f"binaries/{host_folder(description.version)}/"
    try:
        with opened(description.path) as archive:
            archive.extractall(
                folder,
                [
                    name
                    for name in archive.namelist()
                    if not name.startswith(("binaries/", "sources/")) or name.startswith(own)
                ],
            )
    except ComponentTypeError:
        discard(folder)
        raise
    except Exception as error:
        discard(folder)
        raise ComponentTypeError(f"{description.path}: cannot be unpacked: {error}") from error
    return folder


def _load(description: FmuDescription, folder: Path, name: str) -> Any:
    """Load the binary below `folder`; the FMPy object with the FMI functions."""
    second, third = (
        (fmpy.fmi2.FMU2Model, fmpy.fmi3.FMU3Model)
        if description.kind is Kind.MODEL_EXCHANGE
        else (fmpy.fmi2.FMU2Slave, fmpy.fmi3.FMU3Slave)
    )
    bind = second if description.version == 2 else third
    here = Path.cwd()
    try:
        return bind(
            guid=description.token,
            modelIdentifier=description.identifier,
            unzipDirectory=str(folder),
            instanceName=name,
        )
    except Exception as error:
        raise ComponentTypeError(f"{description.path}: cannot be loaded: {error}") from error
    finally:
        if Path.cwd() != here:  # FMPy changes it, and forgets to change it back on errors
            os.chdir(here)
