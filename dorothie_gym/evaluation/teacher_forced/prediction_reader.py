"""Reader of `predictions.parquet`, with a message for every invalid row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import PredictionError, one_line, short_repr
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ABOUT,
    SLOT_TEXTS,
    VERSION,
    ActionPredictions,
    ActPredictions,
    Predictions,
    TaskPredictions,
    joined_actions,
    joined_acts,
)
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove
from dorothie_gym.support.input_files import MIB, ParquetLimits, parse_json, raising, read_parquet

if TYPE_CHECKING:
    import pyarrow as pa

LIMITS: Final = ParquetLimits(file=256 * MIB, rows=500_000, values=69 * 500_000, content=256 * MIB)
"""Limits of a file; the 183 sessions of SDN have 20,000 points, each a row per model and seed."""

SHOWN: Final = 5
"""Number of invalid rows that a message names; the others are counted."""

_PAGE: Final = "see docs/predictions.md"
_REQUIRED: Final = {"version": "int", "model": "str", "seed": "int", "task": "str", "session": "str", "event": "int"}
_ANSWERS: Final = {"move": "str", "action": "str", "angle": "float", "skipped": "str"}
_WANTED: Final = {"int": "whole numbers", "str": "texts", "float": "numbers"}

_LAST_EVENT: Final = 2**31
"""Upper bound of event numbers."""

_MOVES: Final = {move.label: int(move) for move in DialogueMove}
_ACTIONS: Final = {action.label: action.nfd_class for action in NAVIGATION_ACTIONS}
_TASKS: Final = tuple(Task)
_PLACES: Final = {text: place for place, text in enumerate(SLOT_TEXTS)}


@dataclass(frozen=True, eq=False)
class _Rows:
    """Columns of a file as lists of Python values."""

    source: str
    columns: Mapping[str, Sequence[Any]]

    def name(self, row: int) -> str:
        """Returns the name of a row in messages."""
        values = self.columns
        session, task = (one_line(values[name][row], 60) for name in ("session", "task"))
        return f"row {row} (session {session}, event {values['event'][row]}, {task})"


def read_predictions(*paths: Path | str) -> tuple[TaskPredictions, ...]:
    """Reads files of predictions; several may hold several seeds or tasks of one model.

    Returns:
        Predictions of each model, seed and task; models in order of appearance, then seeds, then tasks.

    Raises:
        PredictionError: a file is not a Parquet file, lacks a column, a column has another type, a value is not in the
            vocabulary, or a point has two rows; the message names file, row (counted from 0) and remedy.
        OSError: a file cannot be read.
    """
    found: dict[tuple[str, int, Task], list[TaskPredictions]] = {}
    for path in paths:
        for given in _read_file(Path(path)):
            found.setdefault((given.model, given.seed, given.task), []).append(given)
    models = list(dict.fromkeys(model for model, _, _ in found))
    ordered = sorted(found.items(), key=lambda item: (models.index(item[0][0]), item[0][1], _TASKS.index(item[0][2])))
    return tuple(_merged(pieces) for _, pieces in ordered)


def read_about(path: Path | str) -> dict[str, object]:
    """Returns the provenance in the metadata of a file; empty if there is none.

    Raises:
        PredictionError: the file is not a Parquet file, or its metadata is not valid JSON.
        OSError: it cannot be read.
    """
    about = (_open(Path(path)).schema.metadata or {}).get(ABOUT)
    if about is None:
        return {}
    with raising(lambda message: PredictionError(f"{message}; {_PAGE}")):
        try:
            value = parse_json(about.decode("utf-8"), f"{path}: {ABOUT.decode()} in its metadata")
        except UnicodeDecodeError as error:
            raise PredictionError(f"{path}: {ABOUT.decode()} in its metadata is not UTF-8; {_PAGE}") from error
    return dict(value) if isinstance(value, Mapping) else {"about": value}


def _open(path: Path) -> pa.Table:
    with raising(lambda message: PredictionError(f"{message}; {_PAGE}")):
        return read_parquet(path, LIMITS, (*_REQUIRED, *_ANSWERS, "slots"))


def _read_file(path: Path) -> Iterator[TaskPredictions]:
    table = _open(path)
    _check_columns(table, str(path))
    columns: dict[str, Sequence[Any]] = {
        name: table.column(name).to_pylist() if name in table.column_names else [None] * table.num_rows
        for name in (*_REQUIRED, *_ANSWERS, "slots")
    }
    rows = _Rows(str(path), columns)
    _check_required(rows)
    groups: dict[tuple[str, int, Task], list[int]] = {}
    keys = zip(columns["model"], columns["seed"], columns["task"], strict=True)
    for row, (model, seed, task) in enumerate(keys):
        groups.setdefault((model, seed, Task(task)), []).append(row)
    for (model, seed, task), members in groups.items():
        yield _task_predictions(rows, model, seed, task, members)


def _check_columns(table: pa.Table, source: str) -> None:
    for name in _REQUIRED:
        if name not in table.column_names:
            hint = f"; write the number {VERSION} in every row" if name == "version" else ""
            raise PredictionError(f"{source}: column {name!r} is missing{hint}; {_PAGE}")
    for name, wanted in {**_REQUIRED, **_ANSWERS}.items():
        if name in table.column_names and not _is_type(table.schema.field(name).type, wanted):
            there = _shown(table.schema.field(name).type)
            raise PredictionError(
                f"{source}: column {name!r} holds {there}, but {_WANTED[wanted]} are expected; {_PAGE}"
            )
    if "slots" in table.column_names and not _is_slots(table.schema.field("slots").type):
        raise PredictionError(
            f"{source}: column 'slots' holds {_shown(table.schema.field('slots').type)}, but lists of texts like "
            f"{SLOT_TEXTS[0]!r} or lists of {len(LABELS)} booleans are expected; {_PAGE}"
        )


def _shown(kind: pa.DataType) -> str:
    """Returns the name of a type in a message, without the dictionary in which texts are read."""
    from pyarrow import types

    return one_line(kind.value_type if types.is_dictionary(kind) else kind, 100)


def _is_type(kind: pa.DataType, wanted: str) -> bool:
    from pyarrow import types

    if types.is_null(kind):
        return True  # a column of nulls only: its rows are checked one by one
    if types.is_dictionary(kind):
        kind = kind.value_type
    if wanted == "str":
        return bool(types.is_string(kind) or types.is_large_string(kind) or types.is_string_view(kind))
    return bool(types.is_integer(kind) or (wanted == "float" and types.is_floating(kind)))


def _is_slots(kind: pa.DataType) -> bool:
    from pyarrow import types

    if types.is_null(kind):
        return True
    if not (types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)):
        return False
    return bool(types.is_boolean(kind.value_type)) or _is_type(kind.value_type, "str")


def _check_required(rows: _Rows) -> None:
    """Checks the columns that identify the point of a row."""
    tasks = {task.value for task in Task}
    wrong = []
    for row in range(len(rows.columns["version"])):
        missing = next((name for name in _REQUIRED if rows.columns[name][row] is None), None)
        if missing is not None:
            wrong.append(f"{rows.name(row)}: {missing} is null; it must be given in every row")
        elif (version := rows.columns["version"][row]) != VERSION:
            wrong.append(f"{rows.name(row)}: version is {version}; this release reads version {VERSION}")
        elif not 0 <= rows.columns["event"][row] <= _LAST_EVENT:
            wrong.append(f"{rows.name(row)}: events are counted from 0 within their session")
        elif (task := rows.columns["task"][row]) not in tasks:
            wrong.append(f"{rows.name(row)}: task is {short_repr(task)}; it must be one of {', '.join(sorted(tasks))}")
    _refuse(rows.source, wrong)


def _task_predictions(rows: _Rows, model: str, seed: int, task: Task, members: Sequence[int]) -> TaskPredictions:
    _check_twice(rows, members)
    skipped, session, event = (rows.columns[name] for name in ("skipped", "session", "event"))
    given = [row for row in members if not skipped[row]]
    predicted = _actions(rows, given) if task is Task.NFD else _acts(rows, given)
    return TaskPredictions(
        model=model,
        seed=int(seed),
        task=task,
        sessions=np.array([session[row] for row in given], dtype=np.str_),
        events=np.array([event[row] for row in given], dtype=np.int64),
        predicted=predicted,
        left_out={(session[row], event[row]): skipped[row] for row in members if skipped[row]},
        source=rows.source,
    )


def _check_twice(rows: _Rows, members: Sequence[int]) -> None:
    first: dict[tuple[str, int], int] = {}
    wrong = []
    for row in members:
        key = (rows.columns["session"][row], rows.columns["event"][row])
        if key in first:
            run = f"model {one_line(rows.columns['model'][row], 60)} and seed {rows.columns['seed'][row]}"
            wrong.append(f"{rows.name(row)}: row {first[key]} is of the same point, {run}; leave one of them out")
        first.setdefault(key, row)
    _refuse(rows.source, wrong)


def _acts(rows: _Rows, members: Sequence[int]) -> ActPredictions:
    moves = np.zeros(len(members), dtype=np.int64)
    slots = np.zeros((len(members), len(LABELS)), dtype=np.bool_)
    wrong = []
    for k, row in enumerate(members):
        move, given = rows.columns["move"][row], rows.columns["slots"][row]
        if move not in _MOVES:
            wrong.append(f"{rows.name(row)}: move is {short_repr(move)}; it must be one of {', '.join(_MOVES)}")
        elif fault := _fault_in_slots(given):
            wrong.append(f"{rows.name(row)}: {fault}")
        else:
            moves[k] = _MOVES[move]
            slots[k] = _vector(given)
    _refuse(rows.source, wrong)
    return ActPredictions(moves=moves, slots=slots)


def _fault_in_slots(given: Sequence[Any] | None) -> str | None:
    if given is None:
        return "slots is null; write an empty list where no slot is meant"
    if any(isinstance(value, bool) for value in given):
        if len(given) != len(LABELS) or None in given:
            return f"slots has {len(given)} booleans; it must have {len(LABELS)}, none of them null"
        return None
    unknown = next((value for value in given if value not in _PLACES), None)
    if unknown is None and None not in given:
        return None
    return f"slots names {short_repr(unknown)}; it must be a slot and a value like {SLOT_TEXTS[0]!r} or 'Landmark=KFC'"


def _vector(given: Sequence[Any]) -> NDArray[np.bool_]:
    if given and isinstance(given[0], bool):
        return np.array(given, dtype=np.bool_)
    vector = np.zeros(len(LABELS), dtype=np.bool_)
    vector[[_PLACES[text] for text in given]] = True
    return vector


def _actions(rows: _Rows, members: Sequence[int]) -> ActionPredictions:
    actions = np.zeros(len(members), dtype=np.int64)
    angles = np.zeros(len(members), dtype=np.float64)
    wrong = []
    for k, row in enumerate(members):
        action, angle = rows.columns["action"][row], rows.columns["angle"][row]
        if action not in _ACTIONS:
            wrong.append(f"{rows.name(row)}: action is {short_repr(action)}; it must be one of {', '.join(_ACTIONS)}")
        elif angle is None or not np.isfinite(angle):
            wrong.append(f"{rows.name(row)}: angle is {angle}; write degrees, positive left, 0 where there is none")
        else:
            actions[k], angles[k] = _ACTIONS[action], angle
    _refuse(rows.source, wrong)
    return ActionPredictions(actions=actions, angles=angles)


def _merged(pieces: Sequence[TaskPredictions]) -> TaskPredictions:
    """Joins the predictions of several files for one model, seed and task."""
    if len(pieces) == 1:
        return pieces[0]
    first: dict[tuple[str, int], str] = {}
    for piece in pieces:
        for key in (*zip(piece.sessions.tolist(), piece.events.tolist(), strict=True), *piece.left_out):
            if key in first:
                raise PredictionError(
                    f"{piece.source}: session {key[0]}, event {key[1]}, {piece.task}: {first[key]} has a row for the "
                    f"same point, model {piece.model} and seed {piece.seed}; leave one out, or give them other seeds"
                )
            first[key] = piece.source
    head = pieces[0]
    return TaskPredictions(
        model=head.model,
        seed=head.seed,
        task=head.task,
        sessions=np.concatenate([piece.sessions for piece in pieces]),
        events=np.concatenate([piece.events for piece in pieces]),
        predicted=_together([piece.predicted for piece in pieces]),
        left_out={key: reason for piece in pieces for key, reason in piece.left_out.items()},
        source=", ".join(piece.source for piece in pieces),
    )


def _together(pieces: Sequence[Predictions]) -> Predictions:
    acts = [piece for piece in pieces if isinstance(piece, ActPredictions)]
    if acts:
        return joined_acts(acts)
    return joined_actions([piece for piece in pieces if isinstance(piece, ActionPredictions)])


def _refuse(source: str, wrong: Sequence[str]) -> None:
    """Raises `PredictionError` if a file has faults; the message lists them."""
    if wrong:
        more = [f"... and {len(wrong) - SHOWN} more rows"] if len(wrong) > SHOWN else []
        raise PredictionError(f"{source}: {'; '.join([*wrong[:SHOWN], *more])}")
