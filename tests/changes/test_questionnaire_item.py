"""A new item of a questionnaire: one in a study file, and a new kind of items."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from dorothie_gym.lab.studies.study_file import read_study
from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files
from tests.lab.studies.content import STUDY

ITEMS = "dorothie_gym/lab/studies/items.py"
FORMS = "dorothie_gym/lab/studies/static/forms.js"
NODE = shutil.which("node")

EDITS = (
    Edit(
        ITEMS,
        "Item: TypeAlias = Likert | Choice | Number | Text\n",
        'class Slider(_Item, tag="slider", frozen=True, kw_only=True):\n'
        '    """Share from 0 to 1."""\n\n\n'
        "Item: TypeAlias = Likert | Choice | Number | Text | Slider\n",
    ),
    Edit(
        ITEMS,
        '    """Share from 0 to 1."""\n',
        '    """Share from 0 to 1."""\n\n'
        "    def accept(self, answer: Answer) -> Answer:\n"
        "        if not isinstance(answer, float) or not 0.0 <= answer <= 1.0:\n"
        '            raise AnswerError(f"item {self.id!r} takes a share")\n'
        "        return answer\n",
        r"Slider of dorothie_gym/lab/studies/items\.py lacks `accept`",
    ),
)

FORM_EDITS = (
    Edit(FORMS, "'number', 'text']", "'number', 'text', 'slider']"),
    Edit(
        FORMS,
        "      this.input = item.kind === 'number' ?",
        "      this.input = item.kind === 'slider' ? h('input', "
        "{ ...common, type: 'range', min: 0, max: 1, step: 0.01 })\n"
        "        : item.kind === 'number' ?",
    ),
    Edit(
        FORMS,
        "    if (item.kind === 'number') return text",
        "    if (item.kind === 'number' || item.kind === 'slider') return text",
    ),
)

PROBE = """
from pathlib import Path
import pytest
from dorothie_gym.lab.studies.items import AnswerError, Slider, check_answers
from dorothie_gym.lab.studies.study_file import read_study

study = read_study(Path("study.yaml"))
items = study.questionnaire("after")
assert isinstance(items[-1], Slider) and items[-1].id == "ease"
answers = {"trust": 4, "comment": None}
assert check_answers(items, {**answers, "ease": 0.25})["ease"] == 0.25
with pytest.raises(AnswerError, match="ease"):
    check_answers(items, {**answers, "ease": 2.0})
"""

FIELD = """
import {{ Questionnaire }} from '{forms}';
try {{ new Questionnaire([{{ id: 'ease', kind: 'slider', text: 'How easy was it?' }}], 'draft', () => 0); }}
catch (error) {{ console.log(error.message); }}
"""


def study_with_item(folder: Path, item: dict[str, object]) -> Path:
    """Writes a study that asks for one more item after the sessions."""
    questions = STUDY["questionnaires"]
    study = {**STUDY, "questionnaires": {**questions, "after": [*questions["after"], item]}}
    path = folder / "study.yaml"
    path.write_text(yaml.safe_dump(study), encoding="utf-8")
    return path


def field_error(copy: WorkingCopy) -> str:
    """Returns the message of the page's form for an item of the new kind."""
    static = copy.folder / "static"
    shutil.copytree(copy.folder / "dorothie_gym/lab/studies/static", static, dirs_exist_ok=True)
    shutil.copytree(copy.folder / "dorothie_gym/lab/static", static, dirs_exist_ok=True)
    forms = static / "forms.js"
    forms.write_text(forms.read_text(encoding="utf-8").replace("'/static/", "'./"), encoding="utf-8")
    (static / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    script = static / "field.js"
    script.write_text(FIELD.format(forms="./forms.js"), encoding="utf-8")
    assert NODE is not None
    done = subprocess.run([NODE, str(script)], capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.long
def test_following_the_page_adds_a_kind_of_items(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    study_with_item(tmp_path, {"id": "ease", "kind": "slider", "text": "How easy was it?"})
    follow(copy, EDITS, PROBE)


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_form_names_the_file_that_lacks_a_kind_of_items(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    assert "lab/studies/static/forms.js has no field for items of kind 'slider'" in field_error(copy)
    for edit in FORM_EDITS:
        copy.edit(edit)
    assert "has no field" not in field_error(copy), "the form goes on, and needs a browser"


def test_page_lists_the_files_for_a_kind_of_items() -> None:
    files = [edit.file for edit in (*EDITS, *FORM_EDITS)]
    assert list(dict.fromkeys(files)) == listed_files("A questionnaire item")[:2]


def test_an_item_needs_its_study_file_only(tmp_path: Path) -> None:
    study = read_study(study_with_item(tmp_path, {"id": "ease", "kind": "likert", "text": "It was easy."}))
    assert [item.id for item in study.questionnaire("after")] == ["trust", "comment", "ease"]
