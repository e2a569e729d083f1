"""A headless Chromium, where there is one, driven over a pipe by the DevTools protocol.

The protocol: https://chromedevtools.github.io/devtools-protocol. Not for Windows, which hands no
descriptors to a process so.
"""

import base64
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import CosimError

_NAMES: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_PATIENCE: Final = 60.0  # [s]
_HELPERS: Final = 5.0  # that processes of a browser may outlive it [s]
_OPTIONS: Final = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--no-first-run",
    "--force-color-profile=srgb",
    "--remote-debugging-pipe",
)


class NoBrowserError(CosimError):
    """There is no browser on the path. Exit code 2."""


class BrowserError(CosimError):
    """A browser said no, or ended. Exit code 2."""


def browser_path() -> str | None:
    """The program, or `None`; `NLOSIM_BROWSER` says which one."""
    named = os.environ.get("NLOSIM_BROWSER")
    return named or next(filter(None, map(shutil.which, _NAMES)), None)


class Tab:
    """One page of a browser.

    Attributes:
        errors: what was written to its console as errors, and exceptions that nothing caught.
        requests: addresses that it asked for, without those of itself.
    """

    def __init__(self, reader: int, writer: int) -> None:
        self._reader, self._writer = reader, writer
        self._buffer = b""
        self._number = 0
        self._session: str | None = None
        self.errors: list[str] = []
        self.requests: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        found = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = found["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def processor_time(self) -> float:
        """CPU time of all processes of the browser together, so far [s]."""
        said = self._called(None, "SystemInfo.getProcessInfo", {})
        return float(sum(each["cpuTime"] for each in said["processInfo"]))

    def call(self, method: str, **parameters: Any) -> Any:
        """What a method of the protocol answers."""
        return self._called(self._session, method, parameters)

    def _called(self, session: str | None, method: str, parameters: dict[str, Any]) -> Any:
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        os.write(self._writer, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']}")
                return answer["result"]
            self._note(answer)

    def _read(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            more = os.read(self._reader, 1 << 20)
            if not more:
                raise BrowserError("the browser has gone")
            self._buffer += more
        message, _, self._buffer = self._buffer.partition(b"\0")
        found: dict[str, Any] = json.loads(message)
        return found

    def _note(self, event: dict[str, Any]) -> None:
        said = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown":
                self.errors.append(json.dumps(said["exceptionDetails"])[:2000])
            case "Runtime.consoleAPICalled" if said["type"] in {"error", "warning"}:
                self.errors.append(json.dumps(said["args"])[:2000])
            case "Log.entryAdded" if said["entry"]["level"] in {"error", "warning"}:
                self.errors.append(said["entry"]["text"])
            case "Network.requestWillBeSent":
                self.requests.append(said["request"]["url"])

    def open(self, page: Path, size: tuple[int, int] = (1280, 900), fragment: str = "") -> None:
        """Open a page of ours and wait until it is there.

        Raises:
            TimeoutError: it is not.
        """
        self.resize(*size)
        self.requests.clear()
        self.call("Page.navigate", url=page.as_uri() + fragment)
        self.wait("globalThis.NLOSIM && NLOSIM.page && NLOSIM.page.ready")
        self.frames(3)

    def resize(self, width: int, height: int, *, scale: float = 1.0, mobile: bool = False) -> None:
        """Give the window another size [pixel]."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=mobile,
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=mobile)

    def evaluate(self, expression: str) -> Any:
        """The value of JavaScript in the page; a promise is waited for."""
        found = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise BrowserError(json.dumps(found["exceptionDetails"])[:2000])
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until JavaScript is true.

        Raises:
            TimeoutError: it is not, for a minute.
        """
        end = time.monotonic() + _PATIENCE
        while not self.evaluate(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise TimeoutError(f"`{condition}` did not become true: {self.errors}")
            time.sleep(0.02)

    def frames(self, count: int) -> None:
        """Wait until so many pictures were drawn."""
        self.evaluate(
            f"new Promise((done) => {{ let n = {count}; const next = () => "
            "(n-- ? requestAnimationFrame(next) : done(0)); next(); })"
        )

    def press(self, key: str, code: str = "", text: str = "") -> None:
        """Press a key."""
        more = {"key": key, "code": code or key, **({"text": text} if text else {})}
        self.call("Input.dispatchKeyEvent", type="keyDown", **more)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=code or key)
        self.frames(2)

    def click(self, x: float, y: float) -> None:
        """Move the mouse to a place of the window [pixel] and click."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        self.frames(2)

    def picture(self, path: Path, *, whole: bool = False) -> Path:
        """Write what the window shows, or the whole page, to a PNG file."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))
        return path


@contextmanager
def browser(folder: Path) -> Iterator[Tab]:
    """A page of a new browser, which keeps its files in `folder`.

    Raises:
        NoBrowserError: there is none.
    """
    program = browser_path()
    if program is None:
        raise NoBrowserError(f"no browser: none of {', '.join(_NAMES)} is on the path")
    to_read, browser_writes = os.pipe()
    browser_reads, to_write = os.pipe()

    def pipes() -> None:
        """What the browser reads is its descriptor 3, what it writes is 4."""
        spare = [os.dup(browser_reads), os.dup(browser_writes)]
        for number, descriptor in zip((3, 4), spare, strict=True):
            os.dup2(descriptor, number)

    process = subprocess.Popen(
        [program, *_OPTIONS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        close_fds=False,
        start_new_session=True,
        preexec_fn=pipes,  # noqa: PLW1509 - it only duplicates descriptors
    )
    os.close(browser_reads)
    os.close(browser_writes)
    try:
        yield Tab(to_read, to_write)
    finally:
        process.terminate()
        process.wait(20)
        _end_helpers(process.pid)
        os.close(to_read)
        os.close(to_write)


def _end_helpers(group: int) -> None:
    """Wait until no process of a browser that has ended writes into its folder any more."""
    until = time.monotonic() + _HELPERS
    with suppress(ProcessLookupError):
        while time.monotonic() < until:
            os.killpg(group, signal.SIGKILL)
            time.sleep(0.01)
