"""Component types in Python files beside a scenario: `my_parts:Wheel` is in `my_parts.py`."""

import hashlib
import importlib.util
import inspect
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Final

from typing_extensions import override

from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, in_words
from orchestrator.parameters import ComponentType, PythonComponentType
from orchestrator.suggestion import suggestion

_LOADING: Final = threading.RLock()
"""Held while a module is loaded: whoever serves components loads them in several threads."""


def is_reference(name: str) -> bool:
    """Whether this names a class in a file, rather than an installed type."""
    return ":" in name


def file_of(reference: str, folder: Path) -> Path:
    """The file that `module:Class` or `path/to/module.py:Class` names; dots lead into folders.

    Args:
        reference: as written.
        folder: where relative ones start.
    """
    module, _, _ = reference.rpartition(":")
    is_path = module.endswith(".py")
    *folders, name = module.split(".")
    relative = Path(module) if is_path else Path(*folders, f"{name}.py")
    return (folder / relative).absolute()


def local_type(reference: str, folder: Path) -> ComponentType:
    """The component type that a scenario names by `module:Class`.

    Args:
        reference: as written.
        folder: of the file that says it.

    Raises:
        ComponentTypeError: there is no such file or class, or the file fails when it is imported;
            the message has the line in it.
    """
    name = reference.rpartition(":")[2]
    path = file_of(reference, folder)
    if not path.is_file():
        raise ComponentTypeError(f"there is no file `{path}` for `{reference}`")
    with _LOADING:
        module, files = _loaded(path, reference)
    own = {
        key: each
        for key, each in vars(module).items()
        if inspect.isclass(each) and each.__module__ == module.__name__
    }
    if name not in own:
        kinds = [key for key, each in own.items() if issubclass(each, Component)]
        hint = suggestion(name, kinds) if kinds else "it has no subclass of `Component`"
        raise ComponentTypeError(f"`{path.name}` has no class `{name}`; {hint}")
    found = own[name]
    if not issubclass(found, Component) or inspect.isabstract(found):
        line = inspect.getsourcelines(found)[1]
        abstract = sorted(getattr(found, "__abstractmethods__", ()))
        missing = ", ".join(f"`{each}`" for each in abstract)
        what = f"does not define {missing}" if missing else "is not a subclass of `Component`"
        raise ComponentTypeError(f"{path}:{line}: `{name}` {what}")
    return PythonComponentType(found, files)


def _loaded(path: Path, reference: str) -> tuple[ModuleType, tuple[Path, ...]]:
    """The module in a file, and the files beside it that it consists of.

    It is imported once as long as it has the same text, under a name that no other module has.
    """
    text = path.read_bytes()
    digest = hashlib.sha256(str(path).encode() + b"\0" + text).hexdigest()
    name = f"{path.stem}_{digest[:16]}"
    if name not in sys.modules:
        loader = _OfText(name, path, text)
        spec = importlib.util.spec_from_file_location(name, path, loader=loader)
        assert spec is not None  # noqa: S101 - it has a loader
        module = importlib.util.module_from_spec(spec)
        with _reachable(path.parent):
            before = set(sys.modules)
            sys.modules[name] = module
            try:
                loader.exec_module(module)
            except BaseException as error:
                del sys.modules[name]
                if not isinstance(error, Exception):
                    raise
                raise ComponentTypeError(_why(path, reference, error)) from error
        module.__dict__["_nlosim_files"] = (path, *_beside(path.parent, before, name))
    module = sys.modules[name]
    return module, module.__dict__["_nlosim_files"]


class _OfText(SourceFileLoader):
    """Loads the text that the name of the module is of.

    Python would take the compiled code that it keeps, if the file had the same length and was of
    the same second: a file that a program writes anew for each run would run as it was before.
    """

    def __init__(self, name: str, path: Path, text: bytes) -> None:
        super().__init__(name, str(path))
        self._text = text

    @override
    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self._text, self.path)


@contextmanager
def _reachable(folder: Path) -> Iterator[None]:
    """Let modules of a folder be imported, as Python does for a script in it."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


def _beside(folder: Path, before: set[str], but: str) -> Iterator[Path]:
    """The files beneath a folder whose modules were imported since."""
    for name in sorted(set(sys.modules) - before - {but}):
        file = getattr(sys.modules[name], "__file__", None)
        if file is not None and Path(file).is_relative_to(folder):
            yield Path(file)


def _why(path: Path, reference: str, error: Exception) -> str:
    """What went wrong, with the last line of the file that had a part in it."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        where, what = f"{error.filename}:{error.lineno}:{error.offset}", error.msg
        return f"cannot load `{reference}`: {where}: {what}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    where = f"{path}:{frames[-1].lineno}" if frames else str(path)
    return f"cannot load `{reference}`: {where}: {in_words(error)}"
