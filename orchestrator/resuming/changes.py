"""What changed since a run began: it can be gone on with only if nothing did."""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from orchestrator.recording.layout import RecordingError
from orchestrator.scenario.inputs import digests
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.statement import Statement

_MOST: Final = 8
"""Changes that are named."""


class ChangedError(RecordingError):
    """Something is not what it was when the run began. Exit code 2."""


def check_unchanged(
    scenario: Scenario,
    manifest: Mapping[str, Any],
    now_installed: Mapping[str, str],
    *,
    without: Collection[str] = (),
) -> None:
    """Refuse to go on with a run if the scenario, a file that is read or a version has changed.

    Args:
        scenario: as it is now, with the overrides of then.
        manifest: of the run.
        now_installed: versions of what takes part in it.
        without: names of components whose files are on other hosts.

    Raises:
        ChangedError: it names what did.
    """
    now = json.loads(json.dumps(scenario.resolved()))
    changes = [
        *_differences("", manifest.get("scenario", {}), now),
        *_files(_quoted(manifest.get("files", {})), _quoted(digests(scenario, without=without))),
        *changed_versions(manifest.get("versions", {}), now_installed),
    ]
    _refuse(changes)


def check_places(then: Mapping[str, Mapping[str, Any]], now: Mapping[str, ComponentUse]) -> None:
    """Refuse to go on with a run if other components are on other hosts than were there.

    Args:
        then: what the manifest of the run says of those that were, by name.
        now: those that would be, by name.

    Raises:
        ChangedError: it names them, and says what to do.
    """
    changes = [
        f"`{name}` was on host `{said['host']}`, which takes `--hosts FILE`"
        for name, said in then.items()
        if name not in now
    ]
    changes += [
        f"`{name}` was here, and is on host `{use.host}` with `--hosts`"
        for name, use in now.items()
        if name not in then
    ]
    _refuse(changes)


def check_hosts(then: Mapping[str, Mapping[str, Any]], now: Mapping[str, Statement]) -> None:
    """Refuse to go on with a run if what is on other hosts is not what it was.

    Args:
        then: what the manifest of the run says of the components that were there, by name.
        now: what the hosts say of them.

    Raises:
        ChangedError: it names what changed.
    """
    changes: list[str] = []
    for name, said in then.items():
        there = now[name]
        reader = f"`{name}` on host `{said['host']}`"
        changes += _files({reader: said["files"] or {}}, {reader: there.files or {}})
        if said["nlosim"] != there.nlosim:
            changes.append(
                f"nlosim, which has {reader}, is {there.nlosim}, and was {said['nlosim']}"
            )
    _refuse(changes)


def _refuse(changes: Sequence[str]) -> None:
    if changes:
        more = f"; and {len(changes) - _MOST} more" if len(changes) > _MOST else ""
        named = "; ".join(changes[:_MOST])
        raise ChangedError(
            f"the run cannot go on, because something changed since it began: {named}{more}"
        )


def _differences(path: str, old: Any, new: Any) -> Iterator[str]:
    """Where two documents differ."""
    if old == new:
        return
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys((*old, *new)):
            inner = f"{path}.{key}" if path else str(key)
            if key not in new:
                yield f"`{inner}` is gone"
            elif key not in old:
                yield f"`{inner}` is new"
            else:
                yield from _differences(inner, old[key], new[key])
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _differences(f"{path}.{k}", one, other)
    else:
        yield f"`{path}` is {_short(new)}, and was {_short(old)}"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _quoted(files: Mapping[str, Mapping[str, str]]) -> dict[str, Mapping[str, str]]:
    return {f"`{name}`": each for name, each in files.items()}


def _files(
    old: Mapping[str, Mapping[str, str]], new: Mapping[str, Mapping[str, str]]
) -> Iterator[str]:
    for component in dict.fromkeys((*old, *new)):
        before, after = old.get(component, {}), new.get(component, {})
        for path in dict.fromkeys((*before, *after)):
            if before.get(path) == after.get(path):
                continue
            what = "is new" if path not in before else "is gone"
            if path in before and path in after:
                what = "has another content"
            yield f"`{path}`, which {component} reads, {what}"


def changed_versions(old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[str]:
    """Each version that is another one, as a sentence."""
    for name in dict.fromkeys((*old, *new)):
        if old.get(name) != new.get(name):
            yield f"{name} is {new.get(name, 'not installed')}, and was {old.get(name, 'not')}"
