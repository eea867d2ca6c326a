"""Study files: what is read, and the messages for what is not."""

from __future__ import annotations

import copy
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import InputFileError
from dorothie_gym.lab.studies.study import Method
from dorothie_gym.lab.studies.study_file import check_sources, read_study
from dorothie_gym.ontology import Role
from tests.lab.studies.content import STUDY, write_study


def test_the_example_is_a_study_that_can_be_played() -> None:
    path = Path(str(files("dorothie_gym.lab.studies") / "data" / "example.yaml"))
    study = read_study(path)
    check_sources(study, path)
    assert study.people == (Role.PARTICIPANT, Role.CO_WIZARD)
    assert study.assignment.method is Method.BLOCKS
    assert {"trust_rely", "load_pace"} <= {item.id for item in study.questionnaires.after}


MISTAKES: dict[str, tuple[Any, str]] = {
    "questionnaires.before.0.kind": ("nummer", "invalid value 'nummer'; expected likert, choice, number or text"),
    "questionnaires.before.0.minimum": (4, "questionnaires.before[0]: has no field 'minimum'; it has"),
    "questionnaires.before.0.min": (100, "questionnaires.before[0]: min is 100, more than max, 99"),
    "questionnaires.after.1.id": ("trust", "questionnaires.after[1].id: 'trust' is there twice"),
    "assignment": ({"method": "latin"}, "invalid enum value 'latin'; expected block_randomisation or balanced_latin"),
    "absence.then": ("shrug", "absence.then: invalid enum value 'shrug'; expected end, script or wait"),
    "conditions.1.name": ("Noisy!", "conditions[1].name: expected a name of lower-case letters"),
    "conditions.0.name": ("noisy", "conditions[1].name: 'noisy' is there twice"),
    "conditions.1": ({"name": "empty", "participant": "scripted"}, "conditions[1]: no role is 'human'"),
    "texts.instructions": ({"participant": "Talk."}, "texts.instructions: the text for 'co_wizard' is missing"),
    "texts.instructions.pilot": ("Fly.", "has no field 'pilot'; it has ad_wizard, co_wizard, participant"),
    "session.max_seconds": ("long", "session.max_seconds: expected `float`, got `str`"),
    "tutorial.seconds": (1, "tutorial.seconds: expected `float` >= 5.0"),
    "recruitment.completion.url": ("javascript:alert(1)", "recruitment.completion.url: expected an address"),
    "consent": ({"text": "We record."}, "consent: object missing required field `statements`"),
    "colour": ("red", "has no field 'colour'; it has absence, assignment"),
    "conditions": ([], "conditions: expected `array` of length >= 1"),
}
"""Changes of a sound study: place, value, and the message."""


@pytest.mark.parametrize("place", sorted(MISTAKES))
def test_mistakes_name_file_line_field_and_what_was_expected(tmp_path: Path, place: str) -> None:
    value, message = MISTAKES[place]
    content: Any = copy.deepcopy(STUDY)
    *steps, last = [int(step) if step.isdigit() else step for step in place.split(".")]
    part = content
    for step in steps:
        part = part[step]
    part[last] = value
    with pytest.raises(InputFileError) as caught:
        read_study(write_study(tmp_path, content))
    text = str(caught.value)
    assert text.startswith(f"{tmp_path / 'study.yaml'}, line ") and message in text, text


def test_a_latin_square_needs_the_same_people_in_all_conditions(tmp_path: Path) -> None:
    content = copy.deepcopy(STUDY)
    content["conditions"][1]["co_wizard"] = "scripted"
    read_study(write_study(tmp_path, content))
    content["assignment"] = {"method": "balanced_latin_square"}
    with pytest.raises(InputFileError, match="people play the same roles in all conditions"):
        read_study(write_study(tmp_path, content))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title: one\ntitle: two", "line 2: 'title' is there twice"),
        ("a: &x 1\nb: *x", r"line 2: the alias \*x is not read"),
        ("a: !!python/object:os.system 1", "line 1: the tag"),
        ("a: !!int word", "line 1: 'word' is no int"),
        ("a: [1, 2", "is not YAML"),
        ("- {text: Age?, min: 1}", "put text with signs such as .* in quotes"),
        ("", "is empty"),
        ("- 1", "expected `object`, got `array`"),
        ("[" * 60, "is nested more than 20 deep"),
        ("a: \x00", "is not YAML"),
        ('a: "\\ud800"', r"line 1: the character '\\ud800' cannot be shown"),
        ('a: "\\e[31m"', r"line 1: the character '\\x1b' cannot be shown"),
        ('"\\ud800": 1', "line 1: a name is expected"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(InputFileError, match=message):
        read_study(tmp_path / "study.yaml")


def test_words_that_older_yaml_takes_for_other_types_are_texts(tmp_path: Path) -> None:
    content = copy.deepcopy(STUDY)
    item = {"id": "licence", "kind": "choice", "text": "Licence?", "options": ["OPTIONS"]}
    content["questionnaires"]["before"] = [item]
    file = write_study(tmp_path, content)
    file.write_text(
        file.read_text(encoding="utf-8").replace("- OPTIONS", "- yes\n    - No\n    - 2026-01-01\n    - 12:30")
    )
    (read,) = read_study(file).questionnaires.before
    assert read.options == ["yes", "No", "2026-01-01", "12:30"]  # type: ignore[union-attr]  # a choice


@pytest.mark.parametrize(
    ("part", "entry", "message"),
    [
        ("scenarios", {"town": "atlantis"}, r"scenarios\[2\]: .*atlantis"),
        ("scenarios", {"town": "brookside", "storyboard": "nothing"}, r"scenarios\[2\]: .*nothing"),
        ("conditions", {"name": "more", "ad_wizard": "robot"}, r"conditions\[2\].ad_wizard: .*no policy 'robot'"),
        ("conditions", {"name": "more", "co_wizard": "open"}, r"conditions\[2\].co_wizard: .*are not open"),
        ("conditions", {"name": "more", "co_wizard": "llm:any"}, r"conditions\[2\].co_wizard: .*in real time"),
    ],
)
def test_towns_storyboards_and_policies_are_looked_up(
    tmp_path: Path, part: str, entry: dict[str, str], message: str
) -> None:
    content = copy.deepcopy(STUDY)
    content[part].append(entry)
    file = write_study(tmp_path, content)
    with pytest.raises(InputFileError, match=message):
        check_sources(read_study(file), file)
