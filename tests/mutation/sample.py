"""A random sample of breaks, spread over the areas."""

import hashlib
import inspect
import json
import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TypeVar

from tests.mutation import c_mutants, left_out, operators, python_mutants
from tests.mutation.areas import AREAS, files_of
from tests.mutation.mutant import Mutant

_Item = TypeVar("_Item")


def sample(root: Path, seed: int, areas: Sequence[str] = tuple(AREAS)) -> Iterator[Mutant]:
    """Breaks without end, one of each area in turn, no two alike.

    Who asks for more gets the same beginning. A place of the area is drawn first, with equal
    chances, then one of its breaks. The draws depend on the seed, the name of the file and the text
    of the line, so that a change of the code changes what is drawn of the lines that it changes,
    and nothing else.

    Args:
        root: of the source tree.
        seed: of the random numbers.
        areas: keys of `AREAS`.
    """
    return _in_turn([_of_area(root, area, seed) for area in areas])


def drawn(root: Path, seed: int, count: int, areas: Sequence[str] = tuple(AREAS)) -> list[Mutant]:
    """The first `count` of the sample."""
    return list(islice(sample(root, seed, areas), count))


def kept(path: Path, root: Path, seed: int, count: int, areas: Sequence[str]) -> list[Mutant]:
    """The same, drawn again only if the sources have changed: to find all places takes minutes.

    Args:
        path: of the file where the sample is kept.
        root: of the source tree.
        seed: of the random numbers.
        count: how many.
        areas: keys of `AREAS`.
    """
    digest = hashlib.sha256(f"{seed} {count} {areas}".encode())
    for module in (c_mutants, python_mutants, operators, left_out):
        digest.update(inspect.getsource(module).encode())
    for file in (file for area in areas for file in files_of(area, root)):
        digest.update(f"{file}\0".encode() + (root / file).read_bytes())
    known = json.loads(path.read_text("utf-8")) if path.exists() else {}
    if known.get("of") != digest.hexdigest():
        found = [asdict(mutant) for mutant in drawn(root, seed, count, areas)]
        known = {"of": digest.hexdigest(), "sample": found}
        path.write_text(json.dumps(known), "utf-8")
    return [Mutant(**each) for each in known["sample"]]


def _of_area(root: Path, area: str, seed: int) -> Iterator[Mutant]:
    places = [
        (token, file, place)
        for file in files_of(area, root)
        for token, place in _places(root / file, f"{seed} {file}").items()
    ]
    seen = set()
    for token, file, place in sorted(places):
        rng = random.Random(token)  # noqa: S311 - nothing secret
        if (mutant := _break(root, area, file, place, rng)) and mutant.key() not in seen:
            seen.add(mutant.key())
            yield mutant


def _places(path: Path, name: str) -> dict[str, tuple[int, int]]:
    """Line from 1 and column from 0 of each place, by what gives it its turn; C has no columns."""
    source = path.read_text("utf-8")
    if path.suffix == ".py":
        found = sorted(python_mutants.places(source))
    else:
        found = [(number, 0) for number in c_mutants.lines(source)]
    lines = source.split("\n")
    counts: dict[str, int] = {}
    tokens = {}
    for number, column in found:
        text = f"{name} {column} {lines[number - 1]}"
        counts[text] = counts.get(text, 0) + 1
        token = hashlib.sha256(f"{counts[text]} {text}".encode()).hexdigest()
        tokens[token] = (number, column)
    return tokens


def _break(
    root: Path, area: str, file: str, place: tuple[int, int], rng: random.Random
) -> Mutant | None:
    source = (root / file).read_text("utf-8")
    if file.endswith(".py"):
        choice = rng.choice(_python(source)[place])
        return python_mutants.made(area, file, source, choice)
    return c_mutants.made(area, file, source, place[0], rng.choice(_c(source)[place[0]]))


@lru_cache(maxsize=8)
def _python(source: str) -> dict[tuple[int, int], list[python_mutants.Choice]]:
    return python_mutants.places(source)


@lru_cache(maxsize=8)
def _c(source: str) -> dict[int, list[tuple[str, str]]]:
    return c_mutants.lines(source)


def _in_turn(each: Iterable[Iterator[_Item]]) -> Iterator[_Item]:
    left = list(each)
    while left:
        for one in tuple(left):
            try:
                yield next(one)
            except StopIteration:
                left.remove(one)
