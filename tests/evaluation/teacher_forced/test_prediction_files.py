from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.archive import Task
from dorothie_gym.errors import PredictionError
from dorothie_gym.evaluation.teacher_forced import (
    ActionPredictions,
    ActPredictions,
    TaskPredictions,
    labels_of,
    read_about,
    read_predictions,
    write_predictions,
)
from dorothie_gym.ontology import LABEL_INDEX, LABELS, ActionValue, DialogueMove, LandmarkName, PhysicalAction
from tests.evaluation.teacher_forced.corpora import corpus, no_actions, no_acts, oracle

ROW: dict[str, Any] = {
    "version": 1, "model": "mine", "seed": 3, "task": "ufn", "session": "a", "event": 7,
    "move": "Instruct", "slots": ["Landmark=KFC", "Action=JTurn"],
}  # fmt: skip
DRIVE = {**ROW, "task": "nfd", "event": 9, "move": None, "slots": None, "action": "JTurn", "angle": 88.5}


def file(folder: Path, *rows: dict[str, Any], name: str = "p.parquet") -> Path:
    """A file as somebody else writes it: of just the columns that the first row has."""
    pq.write_table(pa.Table.from_pylist(list(rows)), folder / name)
    return folder / name


def refusal(folder: Path, *rows: dict[str, Any]) -> str:
    with pytest.raises(PredictionError) as error:
        read_predictions(file(folder, *rows))
    return str(error.value)


def test_a_file_that_somebody_else_wrote_is_read(tmp_path: Path) -> None:
    acts, actions = read_predictions(file(tmp_path, {**DRIVE}, ROW))
    assert (acts.model, acts.seed, acts.task) == ("mine", 3, Task.UFN)
    assert (acts.sessions.tolist(), acts.events.tolist()) == (["a"], [7])
    assert isinstance(acts.predicted, ActPredictions) and isinstance(actions.predicted, ActionPredictions)
    assert acts.predicted.moves.tolist() == [int(DialogueMove.INSTRUCT)]
    places = [LABEL_INDEX[ActionValue.J_TURN], LABEL_INDEX[LandmarkName.KFC]]
    assert np.flatnonzero(acts.predicted.slots[0]).tolist() == sorted(places)
    assert actions.predicted.actions.tolist() == [PhysicalAction.J_TURN.nfd_class]
    assert actions.predicted.angles.tolist() == [88.5]


def test_slots_may_be_booleans_in_the_order_of_the_labels(tmp_path: Path) -> None:
    bits = [value is LandmarkName.KFC for value in LABELS]
    (acts,) = read_predictions(file(tmp_path, {**ROW, "slots": bits}))
    assert isinstance(acts.predicted, ActPredictions)
    assert acts.predicted.slots[0].tolist() == bits


def test_texts_may_be_dictionaries_and_angles_whole_numbers(tmp_path: Path) -> None:
    table = pa.Table.from_pylist([{**DRIVE, "angle": 90}])
    table = table.set_column(table.column_names.index("session"), "session", table["session"].dictionary_encode())
    pq.write_table(table, tmp_path / "p.parquet")
    (actions,) = read_predictions(tmp_path / "p.parquet")
    assert isinstance(actions.predicted, ActionPredictions) and actions.predicted.angles.tolist() == [90.0]


def test_a_point_that_is_left_out_says_why(tmp_path: Path) -> None:
    (acts,) = read_predictions(file(tmp_path, {**ROW, "move": None, "slots": None, "skipped": "no audio"}))
    assert len(acts.predicted) == 0 and acts.left_out == {("a", 7): "no audio"}


def test_several_files_are_put_together_by_model_seed_and_task(tmp_path: Path) -> None:
    first = file(tmp_path, ROW, name="1.parquet")
    second = file(tmp_path, {**ROW, "event": 8}, {**ROW, "seed": 2}, {**ROW, "model": "other"}, name="2.parquet")
    found = [(given.model, given.seed, given.events.tolist()) for given in read_predictions(first, second)]
    assert found == [("mine", 2, [7]), ("mine", 3, [7, 8]), ("other", 3, [7])]
    with pytest.raises(PredictionError, match=r"1\.parquet has a row for the same point, model mine and seed 3"):
        read_predictions(first, file(tmp_path, ROW, name="3.parquet"))


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (
            {**ROW, "move": "Instuct"},
            "row 1 (session a, event 7, ufn): move is 'Instuct'; it must be one of Irrelevant",
        ),
        ({**ROW, "move": None}, "move is None"),
        ({**ROW, "slots": ["KFC"]}, "slots names 'KFC'; it must be a slot and a value like"),
        ({**ROW, "slots": None}, "write an empty list where no slot is meant"),
        ({**DRIVE, "action": "SpeedChange"}, "it must be one of LaneFollow, LaneSwitch, UTurn, JTurn, Stop, Start"),
        ({**DRIVE, "angle": None}, "angle is None; write degrees, positive left, 0 where there is none"),
        ({**DRIVE, "angle": float("nan")}, "angle is nan"),
        ({**ROW, "task": "toto"}, "task is 'toto'; it must be one of nfd, rfn, ufn"),
        ({**ROW, "version": 2}, "version is 2; this release reads version 1"),
        ({**ROW, "event": -1}, "events are counted from 0 within their session"),
        ({**ROW, "event": None}, "event is null; it must be given in every row"),
        ({**ROW, "event": 1}, "row 0 is of the same point, model mine and seed 3; leave one of them out"),
    ],
)
def test_error_of_wrong_row_names_row_and_remedy(tmp_path: Path, row: dict[str, Any], words: str) -> None:
    right = {**{name: None for name in {**ROW, **DRIVE}}, **ROW, "event": 1}
    message = refusal(tmp_path, right, row)
    assert message.startswith(f"{tmp_path}/p.parquet: row 1 ") and words in message


def test_of_many_wrong_rows_the_first_are_named(tmp_path: Path) -> None:
    message = refusal(tmp_path, *({**ROW, "event": k, "move": "no"} for k in range(9)))
    assert len(message.splitlines()) == 1 and message.count("move is") == 5 and message.endswith("... and 4 more rows")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": None}, "column 'version' is missing; write the number 1 in every row"),
        ({"seed": "three"}, "column 'seed' holds string, but whole numbers are expected"),
        ({"event": 7.0}, "column 'event' holds double, but whole numbers are expected"),
        ({"move": 4}, "column 'move' holds int64, but texts are expected"),
        ({"slots": "Landmark=KFC"}, "column 'slots' holds string, but lists of texts like"),
    ],
)
def test_error_of_wrong_column_names_it(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    row = {name: value for name, value in {**ROW, **change}.items() if value is not None}
    assert words in refusal(tmp_path, row)


def test_file_that_is_not_parquet_is_refused(tmp_path: Path) -> None:
    (tmp_path / "p.parquet").write_text("session,event\n")
    with pytest.raises(PredictionError, match=r"p\.parquet: not a readable Parquet file"):
        read_predictions(tmp_path / "p.parquet")


@pytest.mark.parametrize("offset", range(4, 400, 41))
def test_damage_is_refused_or_does_no_harm(tmp_path: Path, offset: int) -> None:
    whole = file(tmp_path, ROW, DRIVE).read_bytes()
    (tmp_path / "d.parquet").write_bytes(whole[:offset] + bytes([whole[offset] ^ 0xA7]) + whole[offset + 1 :])
    with contextlib.suppress(PredictionError):
        read_predictions(tmp_path / "d.parquet")
    (tmp_path / "d.parquet").write_bytes(whole[:offset])
    with pytest.raises(PredictionError, match="not a readable Parquet file"):
        read_predictions(tmp_path / "d.parquet")


def test_metadata_of_a_file_must_be_json(tmp_path: Path) -> None:
    table = pa.Table.from_pylist([ROW]).replace_schema_metadata({"dorothie_gym.about": "hashing"})
    pq.write_table(table, tmp_path / "p.parquet")
    with pytest.raises(PredictionError, match="about in its metadata, column 1: not JSON"):
        read_about(tmp_path / "p.parquet")


def test_rows_that_name_no_slot_at_all_are_read(tmp_path: Path) -> None:
    (acts,) = read_predictions(file(tmp_path, {**ROW, "slots": []}))
    assert isinstance(acts.predicted, ActPredictions) and not acts.predicted.slots.any()


def test_provenance_of_predictions_is_written(tmp_path: Path) -> None:
    assert read_about(file(tmp_path, ROW)) == {}
    write_predictions(tmp_path / "q.parquet", [], about={"encoder": "hashing", "layers": 2})
    assert read_about(tmp_path / "q.parquet") == {"encoder": "hashing", "layers": 2}


def test_predictions_of_the_other_kind_or_number_are_refused() -> None:
    given: dict[str, Any] = {"model": "m", "seed": 0, "sessions": np.array(["a"]), "events": np.array([1])}
    with pytest.raises(PredictionError, match="ActPredictions are no predictions of nfd"):
        TaskPredictions(task=Task.NFD, predicted=no_acts(1), **given)
    with pytest.raises(PredictionError, match="1 sessions, 1 events and 2 predictions"):
        TaskPredictions(task=Task.NFD, predicted=no_actions(2), **given)


def test_written_predictions_are_read_back_and_replace_an_older_file(tmp_path: Path) -> None:
    path = tmp_path / "p.parquet"
    labels = labels_of(corpus(tmp_path / "corpus"))
    write_predictions(path, [])
    write_predictions(path, oracle(labels, seed=4))
    read = read_predictions(path)
    assert [one.task for one in read] == list(Task) and {one.seed for one in read} == {4}
    for back in read:
        truth = labels.tasks[back.task]
        assert back.sessions.tolist() == truth.sessions.tolist() and back.events.tolist() == truth.events.tolist()
    assert [child.name for child in tmp_path.glob("p.parquet*")] == ["p.parquet"], "no part is left behind"


@given(
    moves=st.lists(st.integers(0, 14), min_size=1, max_size=5),
    bits=st.lists(st.lists(st.booleans(), min_size=69, max_size=69), min_size=5, max_size=5),
)
@settings(max_examples=20, deadline=None)
def test_any_act_survives_a_file(
    tmp_path_factory: pytest.TempPathFactory, moves: list[int], bits: list[list[bool]]
) -> None:
    path = tmp_path_factory.mktemp("files") / "p.parquet"
    predicted = ActPredictions(moves=np.array(moves), slots=np.array(bits[: len(moves)]))
    events = np.arange(len(moves))
    sessions = np.array(["a"] * len(moves))
    given = TaskPredictions(model="m", seed=0, task=Task.RFN, sessions=sessions, events=events, predicted=predicted)
    (back,) = read_predictions(write_predictions(path, [given]))
    assert isinstance(back.predicted, ActPredictions)
    assert np.array_equal(back.predicted.moves, predicted.moves)
    assert np.array_equal(back.predicted.slots, predicted.slots)
