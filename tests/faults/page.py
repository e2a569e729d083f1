"""The table of a campaign of faults, for the manual."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import median

_TOP = """\
## Faults in runs

Made by `make verify-faults`, the part of the campaign about runs that go on for a while. Random
faults in random runs: two to four components, some in processes of their own, over `local`
or `zenoh`, by Jacobi or Gauss-Seidel, with steps of 10 or 20 ms; half of those at fault have a
child with a session of its own. This is checked of each run: its exit code; that its message names
the component and the reason, without a traceback; the status in manifest.json; that every signal
can be read to the last communication point and is the beginning of that of a run without the fault,
or, where the run goes on, that the fingerprint is the same; that no process is left, nor a
temporary file; that it ends. Checkpoints are written every 100 ms, and runs that did not come to
their end are [gone on with](resuming.md) afterwards, which has to give the fingerprint of the run
without the fault.

"""

_HEADING = (
    "| fault | what happens | runs | exit code | as it should be | gone on with, from checkpoints "
    "| median time, of a run [s] |"
)


_ON_HOSTS = """\

### Hosts

`python -m tests.faults --hosts` has two of three components on a host: `nlosim serve` in a process
of its own, behind a proxy that cuts connections, shuts, or hands on every piece 20 to 30 ms late.
The same is checked, and that the server ends without a traceback. Runs that did not come to their
end are gone on with afterwards, with the same server or, where it was killed or stopped, a new one.
From `docs/results/faults-hosts.csv`:

"""

_STARVED = """\

### Hardly any processor

`python -m tests.faults.starved` has each run at nice 19, with all that belongs to it, beside nine
processes at nice 19 that work all the time: three components in processes of their own or on a
host, 100 ms. Each has to come to its end, with the fingerprint of a run in one process. Processor
time is without that of a server. From `docs/results/starved.csv`:

| components | runs | complete | median time [s] | longest [s] | processor time [s] |
|---|---|---|---|---|---|
"""


def section(
    rows: Sequence[Mapping[str, str]],
    starved: Sequence[Mapping[str, str]] = (),
    on_hosts: Sequence[Mapping[str, str]] = (),
) -> str:
    """The part of docs/reliability.md about this campaign.

    Args:
        rows: of the table of results, one per case.
        starved: of that of runs that hardly got a processor.
        on_hosts: of that of faults with components on a host.
    """
    text = _TOP + _table(rows)
    text += _ON_HOSTS + _table(on_hosts) if on_hosts else ""
    return text + (_STARVED + "".join(_starved(starved)) if starved else "")


def _table(rows: Sequence[Mapping[str, str]]) -> str:
    groups: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in rows:
        groups.setdefault((row["kind"], row["what"]), []).append(row)
    lines = [
        _HEADING,
        "|---|---|---|---|---|---|---|",
    ]
    for (kind, what), group in groups.items():
        good = sum(not row["problems"] for row in group)
        codes = ", ".join(sorted({_code(row) for row in group}))
        time = median(float(row["seconds"]) for row in group)
        counts = f"{len(group)} | {codes} | {good} | {_resumed(group)}"
        lines.append(f"| {kind} | {what} | {counts} | {time:.1f} |")
    good = sum(not row["problems"] for row in rows)
    return "\n".join([f"{good} of {len(rows)} were as they should be.\n", *lines]) + "\n"


def _starved(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    for way in dict.fromkeys(row["way"] for row in rows):
        group = [row for row in rows if row["way"] == way]
        times = [float(row["seconds"]) for row in group]
        used = median(float(row["processor_seconds"]) for row in group)
        good = sum(not row["problems"] for row in group)
        where = "on a host" if way == "hosts" else f"`{way}`"
        counts = f"{len(group)} | {good} | {median(times):.1f} | {max(times):.1f} | {used:.1f}"
        yield f"| {where} | {counts} |\n"


def _resumed(group: Sequence[Mapping[str, str]]) -> str:
    found = [float(row["resumed"]) for row in group if row["resumed"]]
    return f"{len(found)}, {sum(at > 0 for at in found)}" if found else ""


def _code(row: Mapping[str, str]) -> str:
    codes = {"-9": "SIGKILL"}
    transport = (
        f" ({row['transport']})"
        if row["transport"] in {"local", "zenoh"} and row["kind"] == "cut"
        else ""
    )
    return codes.get(row["exit_code"], row["exit_code"]) + transport
