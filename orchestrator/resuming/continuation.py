"""Where a run that was cut off can be gone on with."""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from orchestrator.last_call import FILE, cut_off
from orchestrator.packing import PackingError
from orchestrator.recording.crash import as_ended
from orchestrator.recording.layout import MANIFEST, RecordingError, read_json, write_json
from orchestrator.recording.reopening import Again, reopened
from orchestrator.resuming.files import FOLDER, SETTINGS, checkpoints_of, read_checkpoint
from orchestrator.resuming.keeper import Found
from orchestrator.resuming.steps import check_steps
from orchestrator.timebase import Duration, Time, seconds

OPTIONS: Final = "options"
"""The key of a manifest that says how the run was asked for."""

_ASKED: Final = frozenset({"transport", "figure", "page", "default_measures"})

_NEEDED: Final = (
    "scenario_file",
    "overrides",
    "seed",
    "scenario",
    "files",
    "versions",
    "transport",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How a run with checkpoints was asked for.

    Attributes:
        every: simulated time between two checkpoints [ns]; `None`: there are none.
        transport: as asked for; `None` if it was not.
        figure: whether report and measures draw.
        page: whether `index.html` is written.
        hosts: the hosts file, absolute; `None` if there is none.
        default_measures: see `orchestrator.run.run_scenario`.
    """

    every: Duration | None
    transport: str | None
    figure: bool
    page: bool
    hosts: Path | None
    default_measures: bool

    def write(self, directory: Path) -> None:
        """Keep them in a run directory, whose folder for checkpoints is created."""
        (directory / FOLDER).mkdir(exist_ok=True)
        content = {
            "every_ns": self.every,
            "transport": self.transport,
            "figure": self.figure,
            "page": self.page,
            "hosts": None if self.hosts is None else str(self.hosts),
            "default_measures": self.default_measures,
        }
        write_json(directory / SETTINGS, content)


@dataclass(frozen=True, slots=True, kw_only=True)
class Continuation:
    """A run to be gone on with, and from where.

    Attributes:
        directory: of the run.
        settings: how it was asked for.
        created: when it began, as its manifest says.
        found: the checkpoint; `None`: all is made again from the start.
        again: the recording as it was there; `None`: it begins anew.
        remarks: why it is not a later one.
        compiled: whether compiled code may step FMUs, as it did then.
        hosts: what its manifest says of components on other hosts, by name.
    """

    directory: Path
    settings: Settings
    created: str
    found: Found | None
    again: Again | None
    remarks: tuple[str, ...]
    compiled: bool = True
    hosts: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def time(self) -> Time | None:
        """The time of the checkpoint [ns]; `None` without."""
        return None if self.found is None else self.found.time

    def clear(self) -> None:
        """Remove what the run makes anew."""
        (self.directory / FILE).unlink(missing_ok=True)
        if self.found is None:
            shutil.rmtree(self.directory / "signals", ignore_errors=True)
            for path in (self.directory / FOLDER).glob("*.st*"):
                path.unlink()


def manifest_of(directory: Path) -> dict[str, Any]:
    """The manifest of a run that can be gone on with, or is done.

    Raises:
        RecordingError: there is none, it goes on now, or it was not made by `nlosim run`.
    """
    if not (directory / MANIFEST).is_file():
        raise RecordingError(f"`{directory}` holds no run: it has no {MANIFEST}")
    if (directory / FILE).exists() and cut_off(directory) is None:
        raise RecordingError(f"the run in `{directory}` has not ended: a process works on it")
    manifest = as_ended(directory, read_json(directory / MANIFEST))
    if manifest.get("private") and manifest.get("status") != "done":
        raise RecordingError(
            f"the run in `{directory}` was made with `--private`: its {MANIFEST} does not say "
            "where the scenario is, so nobody can go on with it; make it again"
        )
    missing = [key for key in _NEEDED if key not in manifest]
    if missing:
        raise RecordingError(
            f"the run in `{directory}` is none of `nlosim run`: its {MANIFEST} says nothing of "
            f"{', '.join(f'`{key}`' for key in missing)}"
        )
    return manifest


def settings_of(directory: Path, manifest: Mapping[str, Any]) -> Settings:
    """How the run in `directory` was asked for; what nobody wrote down is as usual."""
    try:
        said = read_json(directory / SETTINGS)
        return Settings(
            every=said["every_ns"],
            transport=said["transport"],
            figure=said["figure"],
            page=said["page"],
            hosts=None if said["hosts"] is None else Path(said["hosts"]),
            default_measures=said["default_measures"],
        )
    except (OSError, RecordingError, KeyError):
        asked = manifest.get(OPTIONS)
        if isinstance(asked, dict) and asked.keys() >= _ASKED:
            return Settings(every=None, hosts=None, **{key: asked[key] for key in _ASKED})
        marks = manifest["scenario"]["components"].values()
        is_usual = any(each.get("process") is True for each in marks)
        transport = None if is_usual else manifest["transport"]
        return Settings(
            every=None,
            transport=transport,
            figure=True,
            page=True,
            hosts=None,
            default_measures=True,
        )


def continuation_of(
    directory: Path, manifest: Mapping[str, Any], *, from_start: bool = False
) -> Continuation:
    """From where the run in `directory` can be gone on with: the newest checkpoint that is sound.

    Nothing is changed.

    Args:
        directory: of the run.
        manifest: of the run.
        from_start: leave checkpoints alone.
    """
    settings = settings_of(directory, manifest)
    remarks: list[str] = []
    start = Continuation(
        directory=directory,
        settings=settings,
        created=manifest.get("created", ""),
        found=None,
        again=None,
        remarks=(),
        hosts=manifest.get("hosts", {}),
    )
    for path in () if from_start or settings.every is None else checkpoints_of(directory):
        try:
            found, again = _opened(directory, path)
        except (RecordingError, PackingError, OSError, KeyError, TypeError, ValueError) as error:
            at = f"t = {seconds(int(path.stem)):.9g} s"
            remarks.append(f"the checkpoint at {at} cannot be used: {error}")
            continue
        return replace(start, found=found, again=again, remarks=tuple(remarks))
    return replace(start, remarks=tuple(remarks))


def _opened(directory: Path, path: Path) -> tuple[Found, Again]:
    content = read_checkpoint(path)
    for name, memory in content["steps"].items():
        check_steps(directory / FOLDER / f"{name}.steps", memory)
    again = reopened(directory, content["recording"])
    return Found(time=content["time"], content=content), again


def told(continuation: Continuation) -> Iterator[str]:
    """What there is to say of it, in lines."""
    yield from continuation.remarks
    found = continuation.found
    if found is None:
        why = "" if continuation.remarks else ", for there is no checkpoint"
        yield f"the run is made again from its start{why}"
        return
    states: Sequence[str] = tuple(found.content["states"])
    steps = {name: memory["count"] for name, memory in found.content["steps"].items()}
    again = ", ".join(f"{count} steps of `{name}`" for name, count in steps.items())
    yield (
        f"the run goes on at t = {seconds(found.time):.9g} s: "
        f"{', '.join(f'`{name}`' for name in states)} restored"
        + (f"; {again} made again" if again else "")
    )
