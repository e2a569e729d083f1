"""The table of a campaign of faults, for the manual."""

from collections.abc import Mapping, Sequence
from statistics import median

_TOP = """\
# Reliability

*Made by `make verify-faults` from `docs/results/faults.csv`.*

Random faults in random runs: two to four components, some in processes of their own, over `local`
or `zenoh`, by Jacobi or Gauss-Seidel, with steps of 10 or 20 ms; half of those at fault have a
child with a session of its own. This is checked of each run: its exit code; that its message names
the component and the reason, without a traceback; the status in manifest.json; that every signal
can be read to the last communication point and is the beginning of that of a run without the fault,
or, where the run goes on, that the fingerprint is the same; that no process is left, nor a
temporary file; that it ends.

"""


def written(rows: Sequence[Mapping[str, str]]) -> str:
    """The page.

    Args:
        rows: of the table of results, one per case.
    """
    groups: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in rows:
        groups.setdefault((row["kind"], row["what"]), []).append(row)
    lines = [
        "| fault | what happens | runs | exit code | as it should be | median time, of a run [s] |",
        "|---|---|---|---|---|---|",
    ]
    for (kind, what), group in groups.items():
        good = sum(not row["problems"] for row in group)
        codes = ", ".join(sorted({_code(row) for row in group}))
        time = median(float(row["seconds"]) for row in group)
        lines.append(f"| {kind} | {what} | {len(group)} | {codes} | {good} | {time:.1f} |")
    good = sum(not row["problems"] for row in rows)
    return _TOP + "\n".join([f"{good} of {len(rows)} were as they should be.\n", *lines]) + "\n"


def _code(row: Mapping[str, str]) -> str:
    codes = {"-9": "SIGKILL"}
    transport = f" ({row['transport']})" if row["kind"] == "cut" else ""
    return codes.get(row["exit_code"], row["exit_code"]) + transport
