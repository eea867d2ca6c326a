import re

import pytest

from dorothie_gym.baselines.model_entries import (
    ALL_ROWS,
    CAMERA_ROWS,
    FORMER_COMMANDS,
    ROWS,
    SIZES,
    find_row,
    stored_row,
)
from dorothie_gym.baselines.toto import ALL_CHANNELS, Channel
from dorothie_gym.evaluation.teacher_forced import paper_figures
from dorothie_gym.evaluation.teacher_forced.paper_comparison import COUNTERPARTS, paper_name


def test_every_row_of_the_papers_table_has_one_counterpart():
    assert sorted(filter(None, (paper_name(row.name) for row in ROWS))) == sorted(paper_figures())
    assert set(COUNTERPARTS) <= {row.name for row in ROWS}


def test_names_claim_no_model_that_is_not_run():
    claims = re.compile(r"BERT|DETR|Detection|E\.T\.|Vision")
    assert not [row.name for row in ALL_ROWS if claims.search(row.name.replace("HuBERT", ""))]
    assert {row.command for row in ALL_ROWS if "HuBERT" in row.name} == {"hubert", "toto-hubert", "sound-hubert"}


def test_former_commands_and_rows_of_the_paper_are_refused_with_the_name_of_today():
    commands = {row.command for row in ALL_ROWS}
    assert set(FORMER_COMMANDS.values()) <= commands and not set(FORMER_COMMANDS) & commands
    former = {"bert", "bert-trained", "toto-bert", "bert-sound", "detector", "et", "et-bert", "detector-queries"}
    assert former | {"et-bert-detections", "toto-no-vision-history", "toto-no-object-detection"} <= set(FORMER_COMMANDS)
    for name, now in [*FORMER_COMMANDS.items(), ("E.T.", "toto-episodic"), ("Deformable-DETR Only", "objects")]:
        with pytest.raises(ValueError, match=f"no model '{re.escape(name)}': it is called '{now}'"):
            find_row(name)


def test_stored_models_are_found_by_the_command_of_their_version():
    assert stored_row("toto-bert") is find_row("toto-trained-text")
    assert stored_row("reader") is find_row("reader")
    with pytest.raises(ValueError, match="'gpt'"):
        stored_row("gpt")


def test_commands_are_words_without_spaces_and_distinct():
    commands = [row.command for row in (*ROWS, *CAMERA_ROWS)]
    assert len(set(commands)) == len(commands)
    assert all(command == command.lower() and " " not in command for command in commands)


def test_a_row_is_found_by_its_command_and_by_its_name():
    assert find_row("toto-no-map-knowledge") is find_row("TOTO (- Map Knowledge)")


@pytest.mark.parametrize(
    ("suffix", "name", "objects"),
    [
        ("boxes", "oracle boxes", "boxes"),
        ("detections", "detections", "detections"),
        ("queries", "queries", "detections"),
    ],
)
def test_rows_that_see_by_the_camera_differ_in_their_objects_only(suffix, name, objects):
    rows = {row.command.removesuffix(f"-{suffix}"): row for row in CAMERA_ROWS if row.command.endswith(f"-{suffix}")}
    episodic = set() if suffix == "queries" else {"toto-episodic", "toto-episodic-trained-text"}
    assert set(rows) == {"toto", "objects", *episodic}
    for command, row in rows.items():
        base = find_row(command)
        assert (base.objects, row.objects) == ("record", objects)
        assert (base.queries, row.queries) == (False, suffix == "queries")
        assert row.change is base.change and row.name == f"{base.name} ({name})"


def test_an_unknown_row_is_refused_with_the_names_of_all():
    with pytest.raises(ValueError, match="'gpt'.*toto, toto-belief"):
        find_row("gpt")


def test_error_of_missing_models_names_the_reason():
    assert {row.command for row in ROWS if row.missing} == {"hubert", "toto-no-current-speech"}
    assert "no audio" in find_row("hubert").missing


@pytest.mark.parametrize("size", SIZES)
def test_each_row_changes_the_inputs_in_its_name(size):
    base = SIZES[size]()
    change = {row.command: row.change(base) for row in ROWS if row.change}
    assert change["toto"] == base
    assert change["toto-belief"].belief and not base.belief
    assert change["toto-trained-text"].text == "trained" and base.text == "frozen"
    assert set(ALL_CHANNELS) - set(change["toto-no-action-history"].channels) == {Channel.ACTIONS, Channel.MOVES}
    assert set(change["toto-episodic"].channels) == {Channel.ACTIONS, Channel.MOVES, Channel.TRANSCRIPT, Channel.VISION}
    assert change["objects"].channels == (Channel.OBJECTS,)
    assert change["map"].channels == (Channel.MAP,)
    assert set(ALL_CHANNELS) - set(change["toto-no-objects"].channels) == {Channel.OBJECTS}
    assert set(ALL_CHANNELS) - set(change["toto-no-object-history"].channels) == {Channel.OBJECTS, Channel.VISION}
    assert change["text"].channels == change["text-trained"].channels == (Channel.TRANSCRIPT,)
