"""`nlosim view`: a run in a browser, or over a WebSocket for Foxglove and Lichtblick.

Nobody can change it.

The run is read from its directory, by this process and not by the one that runs: so a viewer takes
nothing from the run but a share of the machine.
"""

import os
import sys
import threading
from argparse import Namespace
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Final

from orchestrator.cli.outcome import Outcome
from orchestrator.page.live.making import LivePages
from orchestrator.page.live.server import served
from orchestrator.recording.layout import INDEX, MANIFEST, RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.timebase import seconds
from studies.exports.execution import opened
from studies.exports.outputs import ExportError
from studies.exports.player import Player
from studies.exports.show import Show, Stage

_LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
_KIND: Final = 10
"""What is added to the niceness of the process that makes pages, beside the run."""

_TICK: Final = 0.05
"""Time between two looks at a finished run [s]."""

_POLL: Final = 0.5
"""Time between two looks at a run that goes on [s]: the recorder writes as often."""

_RUNS: Final = Path("runs")
_NOT_LIVE: Final = "the run in `{}` does not go on; leave --live out"


def execute(arguments: Namespace) -> Outcome:
    """Serve until a request to stop."""
    if arguments.speed <= 0:
        raise ExportError(f"--speed {arguments.speed:g}: it must be greater than 0")
    directory: Path = arguments.directory or _newest(_RUNS, is_live=arguments.live)
    if arguments.page:
        return _page(directory, arguments)
    viewing = Viewing(directory, speed=arguments.speed, is_live=arguments.live)
    told = viewing.start(arguments.host, arguments.port)
    with suppress(KeyboardInterrupt):
        sys.stderr.write(f"{told}\n")
        sys.stderr.flush()
        viewing.serve(threading.Event())
    viewing.stop()
    return Outcome(
        text=f"\n{viewing.subscriptions} subscriptions; {viewing.sent} samples sent",
        data={
            "directory": str(directory),
            "subscriptions": viewing.subscriptions,
            "samples": viewing.sent,
        },
    )


def _page(directory: Path, arguments: Namespace) -> Outcome:
    """Show the page of a run to browsers until a request to stop."""
    opened(directory)
    if arguments.live and not _is_running(directory):
        raise ExportError(_NOT_LIVE.format(directory))
    _give_way()
    pages = LivePages(directory)
    with suppress(KeyboardInterrupt), served(pages, arguments.host, arguments.port) as address:
        lines = [f"{address} shows `{directory}` in a browser; Ctrl-C ends", *_who(arguments.host)]
        sys.stderr.write("\n".join([*lines, ""]))
        sys.stderr.flush()
        ended = threading.Event()
        pages.serve(ended)
        while not ended.wait(_POLL):  # bounded: a signal just before a wait does not end it
            pass
    made = pages.state().version
    data = {"directory": str(directory), "pages": made}
    return Outcome(text=f"\n{made} pages were made", data=data)


def _give_way() -> None:
    """Let the run have the processor first."""
    with suppress(AttributeError, OSError):  # not on Windows
        os.nice(_KIND)


def _who(host: str) -> list[str]:
    """Who can see the run, if that is more than this machine."""
    if host in _LOOPBACK:
        return []
    return [f"note: who reaches {host} can read the run, without a password"]


def _newest(folder: Path, *, is_live: bool) -> Path:
    """The run in `folder` that was begun last.

    Raises:
        ExportError: there is none.
    """
    found = [each.parent for each in folder.glob(f"*/{MANIFEST}") if (each.parent / INDEX).exists()]
    running = [path for path in found if _is_running(path)]
    candidates = running if is_live else found
    if not candidates:
        what = "no run goes on" if is_live else "there is no run"
        raise ExportError(f"{what} in `{folder}`; name its directory: nlosim view DIR")
    return max(candidates, key=lambda path: (path / INDEX).stat().st_mtime)


def _is_running(directory: Path) -> bool:
    """Whether the run in `directory` goes on; not if its process has died."""
    try:
        return bool(Recording(directory).manifest.get("status") == "running")
    except (OSError, RecordingError):
        return False


@dataclass(frozen=True, slots=True)
class _Wish:
    """What a viewer wants of the player."""

    is_playing: bool
    speed: float
    seek: int | None
    request: str


class _Listener:
    """Hears viewers, in threads of the SDK; what they want waits until it is looked at.

    Args:
        play: the command to play.
    """

    def __init__(self, play: Any) -> None:
        self._play = play
        self.subscriptions = 0
        self.wishes: list[_Wish] = []
        self.is_new = False

    def on_subscribe(self, client: Any, channel: Any) -> None:
        del client, channel
        self.subscriptions += 1
        self.is_new = True

    def on_playback_control_request(self, asked: Any) -> None:
        is_playing = asked.playback_command == self._play
        wish = _Wish(is_playing, asked.playback_speed, asked.seek_time, asked.request_id)
        self.wishes.append(wish)

    def __getattr__(self, name: str) -> Callable[..., None]:
        """All else that viewers say is not listened to."""
        if not name.startswith("on_"):
            raise AttributeError(name)
        return lambda *_: None


class Viewing:
    """A run that is served.

    Args:
        directory: of the run.
        speed: of the player at first, in simulated seconds per second.
        is_live: whether the run must be one that goes on.

    Raises:
        ExportError: there is nothing to serve.

    Attributes:
        sent: samples that were sent.
        is_live: whether the run goes on.
    """

    def __init__(self, directory: Path, *, speed: float = 1.0, is_live: bool = False) -> None:
        self._stage = Stage("nlosim view")
        self._directory = directory
        self._recording = opened(directory)
        self.is_live = _is_running(directory)
        if is_live and not self.is_live:
            raise ExportError(_NOT_LIVE.format(directory))
        self._show = Show(self._recording, directory)
        if not self._show.sources:
            raise ExportError("; ".join(self._show.left_out) or "nothing was recorded")
        self._player = Player(self._show.begin, self._show.end, speed)
        self._listener = _Listener(self._stage.websocket.PlaybackCommand.Play)
        self._server: Any = None
        self._has_controls = False
        self._status: Any = None
        self._seen = self._show.newest()
        self.sent = 0

    @property
    def subscriptions(self) -> int:
        """How often a viewer has asked for a topic."""
        return self._listener.subscriptions

    def start(self, host: str, port: int) -> str:
        """Begin to listen; what to tell the user.

        Args:
            host: address of this machine.
            port: 0: one that is free.

        Raises:
            ExportError: the address is taken, or is none of this machine.
        """
        sdk = self._stage.sdk
        span = None if self.is_live else (self._show.begin, self._show.end)
        self._has_controls = span is not None
        try:
            self._server = sdk.start_server(
                name=f"nlosim {self._directory.resolve().name}",
                host=host,
                port=port,
                server_listener=self._listener,
                context=self._stage.context,
                capabilities=[self._stage.websocket.Capability.Time],
                playback_time_range=span,
            )
        except Exception as error:  # the SDK has errors of its own
            raise ExportError(f"cannot listen at {host}:{port}: {error}") from None
        self._resend(self._show.begin)  # so that there are topics to ask for
        what = "follows the run" if self.is_live else "plays when a viewer comes"
        lines = [
            f"ws://{host}:{self._server.port} {what}: in Foxglove or Lichtblick, open a connection",
            "of type Foxglove WebSocket; Ctrl-C ends",
        ]
        lines += _who(host)
        return "\n".join([*lines, *(f"note: {each}" for each in self._show.left_out)])

    @property
    def port(self) -> int:
        """The port that is listened at."""
        return int(self._server.port)

    def serve(self, ended: threading.Event) -> None:
        """Send what is due, until `ended` is set."""
        while not ended.is_set():
            if self.is_live:
                self.follow()
                ended.wait(_POLL)
            else:
                self.play(monotonic())
                ended.wait(_TICK)

    def stop(self) -> None:
        """Listen no more."""
        self._server.stop()

    def play(self, now: float) -> None:
        """One look at a finished run, at `now` [s]."""
        player, is_moved, request = self._player, False, None
        if self._listener.is_new and not player.is_playing and not self.sent:
            player.play(now)
        while self._listener.wishes:
            wish = self._listener.wishes.pop(0)
            player.advance(now)
            player.speed, request = wish.speed or player.speed, wish.request
            if wish.seek is not None:
                player.seek(wish.seek, now)
                is_moved = True
            if wish.is_playing:
                player.play(now)
            else:
                player.pause()
        if self._listener.is_new or is_moved:
            self._listener.is_new = False
            self._resend(player.time)
        before, after = player.advance(now)
        self.sent += self._show.between(self._stage, before, after)
        if after != before or is_moved:
            self._server.broadcast_time(after)
        self._tell(is_moved=is_moved, request=request)

    def follow(self) -> None:
        """One look at a run that goes on."""
        self.is_live = _is_running(self._directory)
        if self._listener.subscriptions or not self.is_live:
            with suppress(RecordingError):  # its files change; the next look is soon
                self._show = Show(opened(self._directory), self._directory)
            self._send_new()
        if not self.is_live:
            self._say(f"the run has ended at {seconds(self._show.end):g} s")
            self._player = Player(self._show.begin, self._show.end, self._player.speed)
            self._player.seek(self._show.end, 0.0)

    def _send_new(self) -> None:
        """Send what the run has recorded since the last look."""
        if self._listener.is_new:
            self._listener.is_new = False
            self._resend(max(self._seen.values()))
        self.sent += self._show.advance(self._stage, self._seen)
        self._seen = self._show.newest()
        self._server.broadcast_time(max(self._seen.values()))

    def _resend(self, time: int) -> None:
        """Send all that holds at `time` [ns], for who has just come or moved."""
        self._stage.present = set()
        self._show.set_up(self._stage, time)
        self._show.state(self._stage, time)

    def _tell(self, *, is_moved: bool, request: str | None) -> None:
        """Tell viewers where the player is, when that is news."""
        if not self._has_controls:
            return
        websocket, player = self._stage.websocket, self._player
        states = websocket.PlaybackStatus
        status = states.Playing if player.is_playing else states.Paused
        if player.has_ended and not player.is_playing:
            status = states.Ended
        if status == self._status and request is None:
            return
        self._status = status
        state = websocket.PlaybackState(status, player.time, player.speed, is_moved, request)
        self._server.broadcast_playback_state(state)

    def _say(self, text: str) -> None:
        self._server.publish_status(text, self._stage.sdk.StatusLevel.Info)
