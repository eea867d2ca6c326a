import pytest

from dorothie_gym.baselines.model_zoo import CAMERA_ROWS, ROWS, SIZES, find_row
from dorothie_gym.baselines.toto import ALL_CHANNELS, Channel
from dorothie_gym.benchmark import paper_figures


def test_every_row_of_the_papers_table_is_there_in_its_words():
    names = [row.name for row in ROWS]
    assert set(paper_figures()) <= set(names)


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
    assert set(rows) == ({"toto", "detector"} if suffix == "queries" else {"toto", "detector", "et", "et-bert"})
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
    assert change["toto-bert"].text == "trained" and base.text == "frozen"
    assert set(ALL_CHANNELS) - set(change["toto-no-action-history"].channels) == {Channel.ACTIONS, Channel.MOVES}
    assert set(change["et"].channels) == {Channel.ACTIONS, Channel.MOVES, Channel.TRANSCRIPT, Channel.VISION}
    assert change["detector"].channels == (Channel.OBJECTS,)
    assert change["map"].channels == (Channel.MAP,)
    assert change["bert"].channels == change["bert-trained"].channels == (Channel.TRANSCRIPT,)
