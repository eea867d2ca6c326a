"""Mistakes in town files: each is reported with file, line, key and remedy."""

import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.errors import TownError
from dorothie_gym.maps.yaml import read_yaml_town
from dorothie_gym.maps.yaml.schema import read_plan
from tests.maps.yaml_misplaced import MISPLACED
from tests.maps.yaml_mistakes import MISWRITTEN, WRONG_FILES
from tests.maps.yaml_text import MIDTOWN, written
from tests.maps.yaml_wrong_plans import WRONG

MISTAKES = MISWRITTEN | WRONG | MISPLACED


def refusal(path: Path) -> TownError:
    with pytest.raises(TownError) as caught:
        read_yaml_town(path)
    return caught.value


def check(path: Path, line: int | None, fragments: str) -> None:
    message = str(refusal(path))
    place = "file: " if line is None else f"line {line}"
    assert re.match(rf"{re.escape(str(path))}: {place}\b", message), message
    for fragment in fragments.split("|"):
        assert fragment in message


@pytest.mark.parametrize(("old", "new", "line", "fragments"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_reported_with_line_key_and_advice(
    tmp_path: Path, old: str, new: str, line: int, fragments: str
) -> None:
    assert MIDTOWN.count(old) >= 1
    check(written(tmp_path, MIDTOWN.replace(old, new, 1)), line, fragments)


@pytest.mark.parametrize(("text", "line", "fragments"), WRONG_FILES.values(), ids=WRONG_FILES.keys())
def test_a_file_that_is_no_town_is_refused(tmp_path: Path, text: str | bytes, line: int | None, fragments: str) -> None:
    check(written(tmp_path, text), line, fragments)


def test_paths_that_are_no_files_are_refused(tmp_path: Path) -> None:
    check(tmp_path, None, "cannot be read: it is a folder, not a regular file")
    check(tmp_path / "missing.yaml", None, "cannot be read (No such file or directory); check the path")


def test_a_town_with_nothing_wrong_compiles(tmp_path: Path) -> None:
    town = read_yaml_town(written(tmp_path, MIDTOWN))
    assert town.name == "midtown" and len(town.sites) == 2


TOKENS = re.findall(r"-?[\w.]+|\s+|.", MIDTOWN)
JUNCTIONS = ["cross", "market", "gate", "corner", "hill", "circus"]
PIECES = sorted({*TOKENS, "-1", "1e9", ".nan", "~", "''", "&a", "*a", "<<", "---", "\t", "#", "!", "é", "\0"})


@st.composite
def damaged(draw: st.DrawFn) -> str:
    """MIDTOWN with a few of its tokens and lines deleted, replaced or doubled."""
    tokens = list(TOKENS)
    for _ in range(draw(st.integers(1, 2))):
        at = draw(st.integers(0, len(tokens) - 1))
        tokens[at : at + 1] = draw(st.sampled_from([[], [tokens[at]] * 2, [draw(st.sampled_from(PIECES))]]))
    lines = "".join(tokens).splitlines(keepends=True)
    if draw(st.booleans()):
        at = draw(st.integers(0, len(lines) - 1))
        lines[at : at + 1] = draw(st.sampled_from([[], [lines[at]] * 2, [draw(st.sampled_from(lines))]]))
    return "".join(lines)


@st.composite
def moved(draw: st.DrawFn) -> str:
    """MIDTOWN with other numbers, and with streets that run through other junctions."""
    tokens = list(TOKENS)
    numbers = [k for k, token in enumerate(tokens) if re.fullmatch(r"-?\d+", token)]
    for at in draw(st.lists(st.sampled_from(numbers), max_size=6)):
        near = st.integers(-60, 60).map(lambda by, at=at: int(TOKENS[at]) + by)
        tokens[at] = str(draw(st.one_of(near, st.integers(0, 8), st.floats(-300.0, 300.0))))
    names = [k for k, token in enumerate(tokens) if token in JUNCTIONS and tokens[k - 1] != "  "]
    for at in draw(st.lists(st.sampled_from(names), max_size=2)):
        tokens[at] = draw(st.sampled_from(JUNCTIONS))
    return "".join(tokens)


def is_yaml(text: str) -> bool:
    try:
        return yaml.compose(text, Loader=yaml.SafeLoader) is not None
    except yaml.YAMLError:
        return False


def check_read_or_refused(read: Callable[[Path], object], text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = written(Path(folder), text)
        try:
            read(path)
        except TownError as error:
            assert error.source == str(path)
            assert error.reason
            assert error.element.startswith("line ") or not is_yaml(text), str(error)


@settings(max_examples=80, deadline=None)
@given(damaged())
def test_damaged_files_are_read_or_refused_by_line(text: str) -> None:
    check_read_or_refused(read_plan, text)


@settings(max_examples=30, deadline=None)
@given(st.one_of(damaged(), moved()))
def test_changed_files_compile_or_are_refused_by_line(text: str) -> None:
    check_read_or_refused(read_yaml_town, text)
