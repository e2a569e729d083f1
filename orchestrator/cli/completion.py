"""`nlosim completion`: what shells complete, made of the parsers of all that is installed."""

import argparse
import shlex
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from orchestrator import registry
from orchestrator.cli.outcome import Outcome
from orchestrator.cli.parser import arguments_of, parser
from orchestrator.scenario.installed import installed


@dataclass(frozen=True, slots=True)
class _Place:
    """What may come behind some words of a command line.

    Attributes:
        words: the commands and actions so far.
        options: their long names, with what each does.
        offers: commands, actions or names, with what each is.
    """

    words: tuple[str, ...]
    options: Mapping[str, str]
    offers: Mapping[str, str]


def execute(arguments: Namespace) -> Outcome:
    """Print the script for a shell."""
    text = SHELLS[arguments.shell](list(_places(parser(), ())))
    return Outcome(text=text.rstrip("\n"), data={"shell": arguments.shell, "script": text})


def _places(at: argparse.ArgumentParser, words: tuple[str, ...]) -> Iterator[_Place]:
    options: dict[str, str] = {}
    offers: dict[str, str] = {}
    deeper: dict[str, argparse.ArgumentParser] = {}
    for action in arguments_of(at):
        summary = " ".join((action.help or "").split())
        options.update({name: summary for name in action.option_strings if name[:2] == "--"})
        if isinstance(action.choices, dict):
            deeper = action.choices
            told = {each.dest: each.help or "" for each in _summaries(action)}
            offers.update({name: told.get(name, "") for name in deeper})
        elif action.choices and not action.option_strings:
            offers.update({str(choice): "" for choice in action.choices})
    offers.update(_names(words))
    yield _Place(words, options, offers)
    for name, each in deeper.items():
        yield from _places(each, (*words, name))


def _summaries(action: argparse.Action) -> list[argparse.Action]:
    """The lines of the list of commands, for which `argparse` has no public name."""
    return list(action._get_subactions())  # type: ignore[attr-defined]  # noqa: SLF001


def _names(words: tuple[str, ...]) -> dict[str, str]:
    """The installed scenarios or component types, where one is asked for."""
    if words in (("run",), ("check",), ("graph",), ("scene", "show")):
        return dict.fromkeys(installed(), "scenario")
    if words == ("components",):
        return dict.fromkeys(registry.installed(), "component type")
    return {}


def _bash(places: list[_Place]) -> str:
    commands = "|".join(shlex.quote(" ".join(("", *p.words))) for p in places if p.words)
    cases = "\n".join(
        f"    {shlex.quote(' '.join(('', *p.words)))}) "
        f"words={shlex.quote(' '.join((*p.offers, *p.options)))} ;;"
        for p in places
    )
    return f"""\
# bash completion of nlosim; try: source <(nlosim completion bash)
_nlosim() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" seen="" words="" word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$seen $word" in
      {commands}) seen="$seen $word" ;;
    esac
  done
  case "$seen" in
{cases}
  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _nlosim nlosim
"""


def _zsh(places: list[_Place]) -> str:
    _, script = _bash(places).split("\n", 1)
    begin = """\
# zsh completion of nlosim; try: source <(nlosim completion zsh)
autoload -U +X compinit && compinit
autoload -U +X bashcompinit && bashcompinit
"""
    return begin + script


def _fish(places: list[_Place]) -> str:
    lines = ["# fish completion of nlosim; try: nlosim completion fish | source"]
    for place in places:
        deeper = [p.words[-1] for p in places if p.words[:-1] == place.words and p.words]
        seen = [f"__fish_seen_subcommand_from {word}" for word in place.words]
        more = [f"not __fish_seen_subcommand_from {' '.join(deeper)}"] if deeper else []
        when = shlex.quote("; and ".join((*seen, *more)) or "true")
        for name, what in place.offers.items():
            lines.append(
                f"complete -c nlosim -n {when} -a {shlex.quote(name)} -d {_fish_text(what)}"
            )
        for name, what in place.options.items():
            lines.append(f"complete -c nlosim -n {when} -l {name[2:]} -d {_fish_text(what)}")
    return "\n".join(lines) + "\n"


def _fish_text(text: str) -> str:
    """Text for fish, which knows two escapes within single quotes."""
    short = text if len(text) <= 60 else f"{text[:57]}..."
    return "'" + short.replace("\\", "\\\\").replace("'", "\\'") + "'"


SHELLS: Final[Mapping[str, Callable[[list[_Place]], str]]] = {
    "bash": _bash,
    "zsh": _zsh,
    "fish": _fish,
}
