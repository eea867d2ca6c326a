"""Commands and options that the pages name are those of the command line."""

from __future__ import annotations

import enum
import re
import shlex
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, get_args, get_type_hints

import pytest
import typer

from benchmarks.commands import app as benchmarks
from dorothie_gym.cli.app import app

ROOT: Final = Path(__file__).parents[1]

FOLDERS: Final = ("docs", "dorothie_gym", "benchmarks")

PAGES: Final = sorted(
    str(path.relative_to(ROOT))
    for path in (*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md")))
)

FOREIGN: Final = frozenset(
    [
        "--strict",  # mkdocs
        "--check",  # ruff format
        "--no-deps",  # pip
        "--work",  # benchmarks/pretrained.py
        "--rm",  # docker
        "--url",  # openenv validate
        "--model",  # inspect eval
        "--epochs",  # inspect eval
        "--client",  # vf-eval, as the next one
        "--no-push",
    ]
)
"""Options of other programs that the pages name."""

CHANGELOG: Final = "CHANGELOG.md"
"""Page about earlier versions too, whose options may be gone."""

_OPTION: Final = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*")
_CHOICES: Final = re.compile(r"[a-z]+(\|[a-z]+)+")
_SCRIPT_OPTION: Final = re.compile(r'(?:add_argument|addoption|typer\.Option)\(\s*"(--[a-z0-9-]+)"')

COMMANDS: Final = typer.main.get_command(app)
"""The command line: groups have `commands`, commands have `params`."""

PROGRAMS: Final = {"dorothie-gym": COMMANDS, "python -m benchmarks": typer.main.get_command(benchmarks)}
"""Command lines by the words that call them."""


def options_of(command: Any) -> Mapping[str, Any]:
    """Returns the parameters of a command by their options; None for the one that prints the help."""
    found = {option: param for param in command.params for option in (*param.opts, *param.secondary_opts)}
    return {"--help": None, **{option: param for option, param in found.items() if option.startswith("-")}}


def choices_of(command: Any, parameter: Any) -> Collection[str]:
    """Returns the values that a parameter of a command can have; none if it is free."""
    if parameter is None:
        return ()
    if _CHOICES.fullmatch(parameter.metavar or ""):
        return str(parameter.metavar).split("|")
    queue, found = [get_type_hints(command.callback).get(parameter.name)], list[str]()
    while queue:
        kind = queue.pop()
        queue += get_args(kind)
        if isinstance(kind, type) and issubclass(kind, enum.Enum):
            found += [str(member.value) for member in kind]
    return found


def all_options(command: Any) -> Iterator[str]:
    """Yields the options of a command and of those below it."""
    yield from options_of(command)
    for below in getattr(command, "commands", {}).values():
        yield from all_options(below)


def quoted(page: str) -> Iterator[str]:
    """Yields the code of a page: blocks, with continued lines joined, and spans."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^ *```[^\n]*\n(.*?)^ *```", text, flags=re.DOTALL | re.MULTILINE)
    for block in blocks:
        yield from block.replace("\\\n", " ").splitlines()
    rest = re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)
    yield from (" ".join(span.split()) for span in re.findall(r"`([^`]+)`", rest))


def command_lines(page: str, program: str) -> Iterator[list[str]]:
    """Yields the words behind the name of a program, for each of its calls on a page."""
    for code in quoted(page):
        for found in re.finditer(rf"{program}((?:[ \n][^`#&;]*)?)", code):
            line = found[1].split(" | ")[0].replace("[", " ").replace("]", " ").replace("...", " ")
            yield shlex.split(line)


def faults(words: list[str], program: Any = COMMANDS) -> Iterator[str]:
    """Yields what a command line would refuse in a call: names of commands and options, choices, missing values."""
    alternatives: list[Any] = [program]
    while words and not words[0].startswith("-") and hasattr(alternatives[0], "commands"):
        names = [name for name in words[0].split("|") if name]
        unknown = [name for name in names for command in alternatives if name not in command.commands]
        yield from (f"there is no command {name!r}" for name in unknown)
        if unknown:
            return
        alternatives = [command.commands[name] for name in names for command in alternatives]
        words = words[1:]
    for command in alternatives:
        yield from _option_faults(words, command)


def _option_faults(words: list[str], command: Any) -> Iterator[str]:
    options = options_of(command)
    for word, after in zip(words, [*words[1:], ""], strict=False):
        if not re.fullmatch(r"--?[A-Za-z].*", word):
            continue
        name, _, value = word.partition("=")
        if name not in options:
            yield f"{command.name} has no option {name}"
            continue
        choices, given = choices_of(command, options[name]), value or after
        if choices and not given.isupper():  # a word in capitals stands for a value
            yield from (f"{command.name} {name} cannot be {each!r}" for each in given.split("|") if each not in choices)


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("page", [page for page in PAGES if page != CHANGELOG])
def test_every_command_line_of_a_page_is_accepted(page: str, program: str) -> None:
    lines = command_lines(page, program)
    assert not [(" ".join(words), fault) for words in lines for fault in faults(words, PROGRAMS[program])]


@pytest.mark.parametrize("page", [page for page in PAGES if page != CHANGELOG])
def test_every_option_of_a_page_exists(page: str) -> None:
    scripts = [path for folder in ("benchmarks", "docs", "examples", "tests") for path in (ROOT / folder).rglob("*.py")]
    known = {option for path in scripts for option in _SCRIPT_OPTION.findall(path.read_text(encoding="utf-8"))}
    known |= {*FOREIGN, *(option for program in PROGRAMS.values() for option in all_options(program))}
    named = {option for code in quoted(page) for option in _OPTION.findall(code)}
    assert named <= known, "neither a command of the package nor a script has them"


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("generate --out DIR --participant scripted", "generate has no option --participant"),
        ("run|generate --word-errors 0.15 --co-wizard scripted", "generate has no option --co-wizard"),
        ("gnerate --out DIR", "there is no command 'gnerate'"),
        ("study begin errands.yaml", "there is no command 'begin'"),
        ("annotations export corpus out --to elam", "export --to cannot be 'elam'"),
        ("run --video drive.mp4 --view map|side", "run --view cannot be 'side'"),
    ],
)
def test_faults_of_a_command_line_are_found(line: str, fault: str) -> None:
    assert list(faults(line.split())) == [fault]


def test_command_lines_are_found_on_the_pages() -> None:
    found = {name: sum(1 for page in PAGES for words in command_lines(page, name) if words) for name in PROGRAMS}
    assert found["dorothie-gym"] > 150 and found["python -m benchmarks"] > 8
