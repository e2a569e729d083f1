"""One instance behind the functions of its library, whatever its FMI version."""

import ctypes
from collections.abc import Callable
from ctypes import c_char_p, c_size_t, c_void_p
from dataclasses import dataclass
from typing import Any, Final, cast

from adapters.fmi.errors import FmuError
from adapters.fmi.instance import Guard
from adapters.fmi.messages import MessageLog
from adapters.fmi.unpacked import LoadedFmu

_OUT: Final = (c_void_p, c_void_p, c_char_p, c_size_t)
_IN: Final = (c_void_p, c_char_p, c_size_t, c_void_p)


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionNames:
    """What the functions of an FMI version are called that both versions have.

    Attributes:
        prefix: of all of them.
        instantiate: makes an instance.
        state: what they call an FMU state.
        deserialize: makes such a state of bytes.
        directional: gets directional derivatives.
    """

    prefix: str
    instantiate: str
    state: str
    deserialize: str
    directional: str


class Handle:
    """An instance that lives: calls to it, its stored states, and its end.

    Attributes:
        fmu: the library, which goes with the instance.
        guard: judges the status of calls.
        address: of the instance, the first argument of its functions.
    """

    def __init__(
        self,
        fmu: LoadedFmu,
        log: MessageLog,
        names: FunctionNames,
        instantiate: Callable[[LoadedFmu], int | None],
    ) -> None:
        """Instantiate; the library goes again if that fails.

        Args:
            fmu: the loaded library.
            log: receives what the FMU says.
            names: of the functions of its FMI version.
            instantiate: calls the function that makes an instance; its address, if there is one.

        Raises:
            FmuError: there is none.
        """
        self.fmu = fmu
        self.guard = Guard(log)
        self._is_initialised = False
        self._names = names
        self._states: set[int] = set()
        self._is_freed = False
        try:
            self.address = self._made(instantiate(fmu), log)
        except BaseException:
            fmu.unload()
            fmu.discard()
            raise

    def _made(self, address: int | None, log: MessageLog) -> int:
        if not address:
            raise FmuError(f"{self._names.instantiate} returned nothing: {log.reason}")
        return address

    def exit_initialisation(self) -> None:
        """Leave initialisation mode; from now on the end of the instance is a termination."""
        self.call(f"{self._names.prefix}ExitInitializationMode")
        self._is_initialised = True

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of the instance.

        Raises:
            FmuError: it returned neither OK nor Warning.
        """
        self.guard.check(name, self.fmu.call(name, self.address, *arguments))

    def save(self) -> int:
        """Store the FMU state; an address for `restore` and `forget`."""
        state = c_void_p()
        self.call(f"{self._names.prefix}Get{self._names.state}", ctypes.byref(state))
        address = cast("int", state.value)
        self._states.add(address)
        return address

    def restore(self, state: int) -> None:
        """Return to a stored state; a failed instance is sound again."""
        self.call(f"{self._names.prefix}Set{self._names.state}", c_void_p(state))
        self.guard.has_failed = False

    def serialize(self, state: int) -> bytes:
        """A stored state as bytes."""
        prefix, name = self._names.prefix, self._names.state
        pointer, size = c_void_p(state), c_size_t()
        self.call(f"{prefix}Serialized{name}Size", pointer, ctypes.byref(size))
        content = ctypes.create_string_buffer(size.value)
        self._pass(f"{prefix}Serialize{name}", _OUT, pointer, content, size)
        return content.raw

    def deserialize(self, content: bytes) -> int:
        """A stored state made of bytes; an address for `restore` and `forget`.

        Raises:
            FmuError: the FMU does not take them.
        """
        state = c_void_p()
        self._pass(self._names.deserialize, _IN, content, len(content), ctypes.byref(state))
        address = cast("int", state.value)
        self._states.add(address)
        return address

    def _pass(self, name: str, types: tuple[Any, ...], *arguments: Any) -> None:
        """Call a function that takes bytes, which FMPy types as one character."""
        self.guard.check(name, self.fmu.function(name, types)(self.address, *arguments))

    def forget(self, state: int) -> None:
        """Free a stored state; harmless after `free`."""
        if state in self._states and not self.guard.is_dead:
            self._states.discard(state)
            pointer = ctypes.byref(c_void_p(state))
            function = f"{self._names.prefix}Free{self._names.state}"
            self.fmu.call(function, self.address, pointer)

    def free(self) -> None:
        """Free the states, the instance, the library and the temporary folder, once."""
        if self._is_freed:
            return
        self._is_freed = True
        if not self.guard.is_dead:
            for state in tuple(self._states):
                self.forget(state)
            if self._is_initialised and not self.guard.has_failed:
                self.fmu.call(f"{self._names.prefix}Terminate", self.address)
            self.fmu.call(f"{self._names.prefix}FreeInstance", self.address)
            self.fmu.unload()
        self.fmu.discard()
