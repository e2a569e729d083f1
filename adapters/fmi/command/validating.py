"""`nlosim fmu validate`."""

from collections.abc import Sequence
from pathlib import Path

from adapters.fmi.validation import Finding, validate
from orchestrator.cli.outcome import Exit, Outcome, failure


def validated(paths: Sequence[Path]) -> Outcome:
    """Tell every broken rule of the FMUs in `paths`."""
    found: dict[Path, list[Finding]] = {}
    for path in paths:
        try:
            found[path] = validate(path)
        except OSError as error:
            return failure("fmu", Exit.WRONG_INPUT, f"{path}: cannot be read: {error.strerror}")
    lines = []
    for path, findings in found.items():
        lines += [str(each) for each in findings]
        broken = sum(not each.is_remark for each in findings)
        said = "no broken rule" if not broken else f"{broken} broken rule{'s' * (broken > 1)}"
        lines.append(f"{path}: {said}")
    is_valid = all(each.is_remark for findings in found.values() for each in findings)
    return Outcome(
        text="\n".join(lines),
        data={"fmus": [{"path": str(p), "findings": list(map(_row, f))} for p, f in found.items()]},
        exit_code=Exit.DONE if is_valid else Exit.NOT_PASSED,
    )


def _row(finding: Finding) -> dict[str, str | int | bool | None]:
    place = finding.place
    return {
        "file": finding.file,
        "line": None if place is None else place.line,
        "column": None if place is None else place.column,
        "what": finding.what,
        "rule": finding.rule,
        "remark": finding.is_remark,
    }
