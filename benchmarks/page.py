"""Makes the page of results from what `nlosim bench NAME --json` wrote.

python -m benchmarks.page PAGE RESULT.json...
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Row
from benchmarks.table import markdown

_HEAD = """\
# Benchmarks

This page is made by `make bench`. Times are CPU times of one process, user and system, one thread,
unless the unit says otherwise.
Repetitions of the cases take turns; shown are the median and, in brackets, the smallest and the
largest. A ratio above 1 means that ours is better than the peer.
"""


def page(results: Sequence[Path]) -> str:
    """The page as Markdown.

    Args:
        results: JSON files of single benchmarks. Remarks in a file of the same name that ends in
            `.md` follow the numbers.
    """
    parts = [_HEAD]
    for path in results:
        parts.append(_section(json.loads(path.read_text(encoding="utf-8"))))
        remarks = path.with_suffix(".md")
        if remarks.is_file():
            parts.append(remarks.read_text(encoding="utf-8"))
    return "\n".join(parts)


def _section(result: Mapping[str, Any]) -> str:
    machine = result["machine"]
    memory = "" if machine["memory_gib"] is None else f"{machine['memory_gib']} GiB, "
    host = f"{machine['cpu']}, {machine['cpus']} CPUs, {memory}{machine['platform']}"
    settings = "".join(f" --set {key}={value}" for key, value in result.get("settings", {}).items())
    command = f"nlosim bench {result['name']}{settings} --repeat {result['repetitions']} --json"
    lines = [
        f"## {result['name']}",
        "",
        f"{result['description'][0].upper()}{result['description'][1:]}.",
        "",
        f"* command: `{command}`",
        f"* commit: {result['commit']}, {result['created']}",
        f"* machine: {host}, load average {machine['load_average']}",
        f"* versions: {', '.join(map(' '.join, result['versions'].items()))}",
        *([f"* peer: {result['peer']}"] if result["peer"] else []),
    ]
    rows = [Row.from_json(row) for row in result["rows"]]
    for group, members in groupby(rows, key=lambda row: row.case.partition("/")[0]):
        lines += ["", f"### {group}", "", *markdown(list(members))]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Read the arguments and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("page", type=Path, metavar="PAGE")
    parser.add_argument("results", type=Path, nargs="+", metavar="RESULT.json")
    arguments = parser.parse_args()
    arguments.page.write_text(page(arguments.results), encoding="utf-8")


if __name__ == "__main__":
    main()
