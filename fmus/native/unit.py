"""A native unit: its interface, its C files, and what is generated to compile them with."""

import ctypes
import hashlib
import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fmus.native.c_records import records_header
from fmus.native.c_table import variables_header, variables_source
from fmus.native.check import InterfaceError
from fmus.native.interface import Interface
from fmus.native.model_description import model_description
from fmus.native.targets import CompilerError, compile_library, select_targets

UNITS: Final = ("channel", "lidar", "perception")
"""Names of the native units of this package."""

SHELL: Final = Path(__file__).parent
"""The folder of the C files that all units share."""

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
    "portable_math.h",
    "random_normal.h",
)
MODEL_VERSION: Final = "0.1.0"


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A native unit: its interface and the folder of its sources."""

    interface: Interface
    folder: Path

    def sources(self) -> list[Path]:
        """The C files that are written by hand, the shell's first."""
        own = [self.folder / name for name in self.interface.sources]
        return [*(SHELL / name for name in SHELL_SOURCES), *own]

    def headers(self) -> list[Path]:
        """The C headers that are written by hand, the shell's first."""
        own = [self.folder / name for name in self.interface.headers]
        return [*(SHELL / name for name in SHELL_HEADERS), *own]

    def token(self) -> str:
        """The instantiationToken: it changes with the interface, the records and the sources."""
        description = model_description(self.interface, token="", version=MODEL_VERSION)
        digest = hashlib.sha256(description)
        digest.update(records_header().encode())
        for path in (*self.sources(), *self.headers()):
            digest.update(path.name.encode() + b"\0" + source_text(path) + b"\0")
        return f"{{{digest.hexdigest()[:32]}}}"

    def description(self) -> bytes:
        """The bytes of modelDescription.xml."""
        return model_description(self.interface, token=self.token(), version=MODEL_VERSION)

    def generated(self) -> Mapping[str, str]:
        """The texts of the C files that are not written by hand, by name."""
        return {
            "records.h": records_header(),
            "variables.h": variables_header(self.interface),
            "variables.c": variables_source(self.interface, self.token()),
        }

    def write_generated(self, folder: Path) -> None:
        """Write the C files that are not written by hand into `folder`, which exists."""
        for name, text in self.generated().items():
            (folder / name).write_text(text)


def load_unit(name: str) -> Unit:
    """The unit called `name` of this package, or the one in the folder `name`.

    Raises:
        InterfaceError: there is no `interface.py`, or no `INTERFACE` in it.
    """
    own = SHELL.parent / name
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


def source_text(path: Path) -> bytes:
    """The bytes of a source file with the line ends of Unix, whatever git made of them here."""
    return path.read_bytes().replace(b"\r\n", b"\n")


def compile_parts(unit: Unit, names: Sequence[str], *, wrapper: Path, folder: Path) -> ctypes.CDLL:
    """Compile and load some C files of a unit, and a wrapper around them.

    Tests and benchmarks call functions of a unit so, compiled for this host as in the FMU.

    Args:
        unit: whose C files they are.
        names: of C files of the unit or of the shell.
        wrapper: one more C file, which exports what is to be called.
        folder: for the library and for what is generated; it must outlive the library.

    Raises:
        CompilerError: there is no compiler, or it refuses the sources.
    """
    (target,) = select_targets(["host"])
    unit.write_generated(folder)
    library = folder / f"{wrapper.stem}{target.suffix}"
    files = {path.name: path for path in unit.sources()}
    compile_library(
        target,
        sources=[*(files[name] for name in names), wrapper],
        include=[folder, unit.folder, SHELL],
        system_include=fmi_headers(),
        library=library,
    )
    return ctypes.CDLL(str(library))
