"""Repeating a run, and comparing what comes of it with what was recorded then."""

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import CosimError
from orchestrator.manifest import PATHS, distributions
from orchestrator.observer import Observer
from orchestrator.provenance import versions
from orchestrator.recording.crash import as_ended
from orchestrator.recording.difference import Difference, differences
from orchestrator.recording.layout import MANIFEST, RecordingError, read_json
from orchestrator.recording.reader import Recording
from orchestrator.rerunning.inputs import found_inputs, other_files
from orchestrator.resuming.changes import changed_versions
from orchestrator.resuming.continuation import OPTIONS
from orchestrator.run import no_line, run_scenario, to_nobody
from orchestrator.run_directory import new_directory
from orchestrator.run_outcome import RunOutcome
from orchestrator.scenario.absent import AbsentType
from orchestrator.scenario.build import built
from orchestrator.scenario.document import Address, Document
from orchestrator.scenario.inputs import digests
from orchestrator.scenario.model import Scenario
from orchestrator.statement import files_of

_NEEDED: Final = ("scenario", "overrides", "files", "versions", "transport", PATHS, OPTIONS)


class RerunError(CosimError):
    """A run cannot be repeated. Exit code 2.

    Attributes:
        reasons: all of them, one sentence each.
    """

    def __init__(self, what: str, reasons: Sequence[str] = ()) -> None:
        super().__init__("\n  ".join([what, *reasons]))
        self.reasons = tuple(reasons)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A run that can be repeated.

    Attributes:
        directory: of the run.
        manifest: of the run.
        scenario: with the inputs that were found.
        changed: inputs of another content.
        versions: what is installed in another version, as sentences.
    """

    directory: Path
    manifest: Mapping[str, Any]
    scenario: Scenario
    changed: tuple[str, ...]
    versions: tuple[str, ...]

    @property
    def is_private(self) -> bool:
        """Whether the run was made with `--private`."""
        return bool(self.manifest.get("private"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeated:
    """A run, and the same again.

    Attributes:
        outcome: of the second one.
        fingerprint: of the first one.
        differing: the first difference of every signal that has one, the earliest first.
        faults: why the first recording cannot tell where it differs.
    """

    outcome: RunOutcome
    fingerprint: str
    differing: tuple[Difference, ...] = field(default=())
    faults: tuple[str, ...] = field(default=())

    @property
    def is_equal(self) -> bool:
        """Whether every byte that was recorded is the same."""
        return self.outcome.fingerprint == self.fingerprint


def planned(directory: Path, inputs: Path | None = None, *, anyway: bool = False) -> Plan:
    """How the run in `directory` can be repeated.

    Args:
        directory: of a run that is done; its manifest is enough.
        inputs: where files that it read are looked for first; `None`: where they were.
        anyway: whether inputs of another content will do.

    Raises:
        RerunError: it cannot be repeated, for reasons that are all named.
        RecordingError: there is no run.
        ScenarioError: something that it needs is not installed.
    """
    manifest = _manifest(directory)
    if inputs is not None and not inputs.is_dir():
        raise RerunError(f"there is no folder `{inputs}`")
    found = found_inputs(manifest, inputs)
    if found.missing:
        _refuse(directory, found.missing, found.changed, inputs)
    document = _document(directory, manifest, found.texts)
    file = Path(str(manifest.get("scenario_file", "scenario")))
    folder = file.parent.absolute() if inputs is None else inputs.absolute()
    scenario = built(document, folder / file.name)
    absent = [
        f"`{name}` was on the host `{use.host}`, and cannot be here: {use.type.reason}"
        for name, use in scenario.components.items()
        if isinstance(use.type, AbsentType)
    ]
    missing, changed = other_files(manifest["files"], _digests(scenario, manifest))
    changed = list(dict.fromkeys([*found.changed, *changed, *_other_code(scenario, manifest)]))
    if absent or missing or (changed and not anyway):
        _refuse(directory, [*absent, *missing], changed, inputs)
    outside = list(_outside(scenario))
    if outside:
        raise RerunError(f"the run in `{directory}` cannot be repeated", outside)
    now = versions(distributions(scenario, manifest["transport"]))
    return Plan(
        directory=directory,
        manifest=manifest,
        scenario=replace(scenario, overrides=tuple(manifest["overrides"])),
        changed=tuple(changed),
        versions=tuple(changed_versions(manifest["versions"], now)),
    )


def repeat(
    plan: Plan,
    out: Path | None = None,
    *,
    transport: str | None = None,
    private: bool = False,
    tell: Callable[[str], None] = no_line,
    observers: Sequence[Observer] = (),
    echo_warnings: bool = False,
    announce: Callable[[Path], None] = to_nobody,
) -> Repeated:
    """Make a run again, and compare.

    Args:
        plan: as `planned` made it.
        out: the directory of the new run; `None`: `DIR-rerun` beside the old one, numbered.
        transport: in place of that of the run; the results do not depend on it.
        private: as in `run_scenario`; so is a run of one that was.
        tell: is called with each line of what there is to say before.
        observers: watch the run.
        echo_warnings: whether what is logged as a warning appears on standard error, too.
        announce: called with the new directory before anything is simulated.

    Raises:
        ScenarioError, RunFailedError, RunInterrupted: as `run_scenario`.
    """
    manifest = plan.manifest
    if out is None:
        name = plan.directory.absolute().name
        out = new_directory(plan.directory.parent, f"{name}-rerun")
    for line in (*plan.changed, *plan.versions):
        tell(line)
    kept = ("scenario_files", "installed")
    outcome = run_scenario(
        plan.scenario,
        out,
        transport=manifest[OPTIONS].get("transport") if transport is None else transport,
        observers=observers,
        echo_warnings=echo_warnings,
        figure=False,
        default_measures=bool(manifest[OPTIONS].get("default_measures")),
        announce=announce,
        private=private or plan.is_private,
        more={
            **{key: manifest[key] for key in kept if key in manifest},
            "rerun_of": {key: manifest.get(key) for key in ("created", "fingerprint")},
        },
    )
    found = Repeated(outcome=outcome, fingerprint=manifest["fingerprint"])
    return found if found.is_equal else _compared(found, plan.directory)


def _compared(found: Repeated, directory: Path) -> Repeated:
    """Where the second run differs."""
    try:
        then = Recording(directory)
        faults = then.faults()
        if not faults:
            differing = differences(then, Recording(found.outcome.directory))
            return replace(found, differing=tuple(differing))
    except RecordingError as error:
        faults = (str(error),)
    return replace(found, faults=faults)


def _manifest(directory: Path) -> dict[str, Any]:
    """The manifest of a run that is done."""
    if not (directory / MANIFEST).is_file():
        raise RecordingError(f"`{directory}` holds no run: it has no {MANIFEST}")
    manifest = as_ended(directory, read_json(directory / MANIFEST))
    missing = [f"`{key}`" for key in _NEEDED if key not in manifest]
    if missing:
        raise RerunError(
            f"the run in `{directory}` cannot be repeated from its {MANIFEST}: that says nothing "
            f"of {', '.join(missing)}, as those of earlier releases"
        )
    status = manifest.get("status")
    if status != "done" or not manifest.get("fingerprint"):
        why = manifest.get("error")
        raise RerunError(
            f"the run in `{directory}` did not come to its end ({status}"
            f"{f': {why}' if why else ''}), so there is nothing to compare with; `nlosim resume` "
            "goes on with it"
        )
    return manifest


def _document(
    directory: Path, manifest: Mapping[str, Any], texts: Mapping[Address, str]
) -> Document:
    """The resolved scenario, with the paths of here."""
    data = copy.deepcopy(manifest["scenario"])
    for at, text in texts.items():
        *way, last = at
        place = data
        try:
            for key in way:
                place = place[key]
            place[last] = text
        except (LookupError, TypeError):
            where = ".".join(map(str, at))
            raise RecordingError(
                f"`{directory / MANIFEST}` is damaged: its scenario has no `{where}`"
            ) from None
    file = str(directory / MANIFEST)
    return Document(file, data, {}, folders={file: directory.absolute()})


def _digests(scenario: Scenario, manifest: Mapping[str, Any]) -> Mapping[str, Mapping[str, str]]:
    """Digests of all that is read now, but for components whose files were on other hosts."""
    return digests(scenario, without=manifest.get("hosts", {}))


def _other_code(scenario: Scenario, manifest: Mapping[str, Any]) -> Iterator[str]:
    """Code and files of components that were on other hosts, and are not the same here."""
    folder = scenario.path.parent
    for name, said in manifest.get("hosts", {}).items():
        use = scenario.components[name]
        here = {} if isinstance(use.type, AbsentType) else files_of(use, folder)
        for file, content in (said.get("files") or {}).items():
            if here.get(file, content) != content:
                yield f"`{file}` of `{name}`, which was on a host, has another content"


def _outside(scenario: Scenario) -> Iterator[str]:
    """Files that components write elsewhere than into the directory of the run."""
    for name, use in scenario.components.items():
        for path in use.type.output_files(use.all_values()):
            if path.is_absolute():
                yield f"`{name}` writes `{path}`, which is not in the directory of the run"


def _refuse(
    directory: Path, missing: Sequence[str], changed: Sequence[str], inputs: Path | None
) -> None:
    hints = []
    if missing:
        where = "elsewhere" if inputs is None else f"not in `{inputs}`"
        hints.append(f"`--inputs FOLDER` says where files are, if {where}")
    elif changed:
        hints.append("`--anyway` repeats it with what is here")
    what = f"the run in `{directory}` cannot be repeated with what is here"
    raise RerunError(what, [*missing, *changed, *hints])
