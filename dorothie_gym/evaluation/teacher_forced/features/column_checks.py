"""Checks of columns that were read from a file: lengths, types, references between rows, and ranges."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.recorded_perception import OBJECT_VALUES, ObjectKind
from dorothie_gym.evaluation.teacher_forced.features.columns import GROUPS, NO_TEXT, Columns, TownGraph
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove

_KINDS: Final[Mapping[str, str]] = MappingProxyType(
    {"Ints": "iu", "Reals": "f", "Flags": "b", "NDArray[np.int64]": "i"}
)
"""Kinds of numpy types by the annotation of a field."""

_WIDTHS: Final[Mapping[str, int]] = MappingProxyType(
    {"slots": len(LABELS), "pose": 3, "place": 2, "values": len(OBJECT_VALUES), "lanes": len(FEATURES)}
)
"""Sizes of the second axis of two-dimensional columns."""

_OPEN: Final = ("label_angle", "speed")
"""Columns in which NaN denotes an unknown number."""

_STARTS: Final = ("start", "member_start")


def fault_in(columns: Columns) -> str | None:
    """Returns the fault of columns; None if a reader can rely on them."""
    return next(_faults(columns), None)


def _faults(columns: Columns) -> Iterator[str]:
    sessions = len(columns.sessions.names)
    if len(columns.sessions.folds) != sessions or len(columns.sessions.town) != sessions:
        yield "the columns of sessions have different lengths"
    if not all(isinstance(text, str) for text in (*columns.texts, *columns.sessions.names, *columns.sessions.folds)):
        yield "a text is no text"
    for group in GROUPS:
        yield from _of_types(getattr(columns, group), group)
    for town in columns.towns:
        yield from _of_types(town, f"town {town.name!r}")
    yield from _references(columns)
    for town in columns.towns:
        yield from _references_of(town)


def _of_types(part: Any, name: str) -> Iterator[str]:
    """Yields faults in types, shapes and numbers of the columns of a group."""
    lengths = set()
    for field in dataclasses.fields(part):
        array = getattr(part, field.name)
        if not isinstance(array, np.ndarray):
            continue
        where, width = f"column {name}.{field.name}", _WIDTHS.get(field.name)
        if array.dtype.kind not in _KINDS.get(str(field.type), ""):
            yield f"{where} is of type {array.dtype}"
            return
        if field.name == "edges":
            if array.ndim != 2 or len(array) != 2:
                yield f"{where} has the shape {array.shape}"
                return
            continue
        wanted = 1 if width is None or (field.name == "values" and array.ndim == 1) else 2
        if array.ndim != wanted or (wanted == 2 and array.shape[1] != width):
            yield f"{where} has the shape {array.shape}"
            return
        if array.dtype.kind == "f" and not np.all(np.isfinite(array) | (field.name in _OPEN)):
            yield f"{where} has a value that is not finite"
        if not isinstance(part, TownGraph) and field.name not in _STARTS:
            lengths.add(len(array))
        elif field.name in _STARTS and (len(array) == 0 or array[0] != 0 or np.any(np.diff(array) < 0)):
            yield f"{where} does not rise from 0"
    if len(lengths) > 1:
        yield f"the columns of {name} have different lengths"


def _references(columns: Columns) -> Iterator[str]:
    """Yields columns that refer to rows, texts or members of vocabularies that do not exist."""
    sessions, texts = len(columns.sessions.names), len(columns.texts)
    groups = {group: getattr(columns, group) for group in GROUPS}
    limits: dict[str, tuple[NDArray[Any], int, int]] = {
        "sessions.town": (columns.sessions.town, 0, len(columns.towns)),
        "moves.utterance": (columns.moves.utterance, 0, len(columns.utterances.tenth)),
        "moves.move": (columns.moves.move, 0, len(DialogueMove)),
        "moves.handling": (columns.moves.handling, 0, 3),
        "actions.handling": (columns.actions.handling, 0, 3),
        "actions.action": (columns.actions.action, 0, len(PhysicalAction)),
        "actions.up": (columns.actions.up, -1, 2),
        "frames.look": (columns.frames.look, -1, len(columns.looks.tenth)),
        "objects.kind": (columns.objects.kind, 0, max(ObjectKind) + 1),
    }
    for group, part in groups.items():
        for name, array in vars(part).items():
            if name == "session":
                limits[f"{group}.{name}"] = array, 0, sessions
            elif name == "speaker":
                limits[f"{group}.{name}"] = array, 0, 2
            elif name.endswith("text"):
                limits[f"{group}.{name}"] = array, NO_TEXT, texts
    for name, (array, least, end) in limits.items():
        if len(array) and not (array.min() >= least and array.max() < end):
            yield f"column {name} has a value outside of {least}..{end - 1}"
    for group, rows in (("landmarks", columns.landmarks), ("streets", columns.streets)):
        if len(rows.start) != sessions + 1 or rows.start[-1] != len(rows.text):
            yield f"column {group}.start does not end at the last row"
    if len(columns.looks.start) != len(columns.looks.tenth) + 1 or columns.looks.start[-1] != len(columns.objects.kind):
        yield "column looks.start does not end at the last row"


def _references_of(town: TownGraph) -> Iterator[str]:
    lanes, streets = len(town.lanes), len(town.member_start) - 1
    for name, array, least, end in (
        ("edges", town.edges, 0, lanes),
        ("members", town.members, 0, lanes),
        ("street", town.street, -1, max(streets, 0)),
        ("edge_types", town.edge_types, 0, len(EDGE_TYPES)),
    ):
        if array.size and not (array.min() >= least and array.max() < end):
            yield f"column {name} of town {town.name!r} has a value outside of {least}..{end - 1}"
    if {len(town.road), len(town.junction), len(town.street)} != {lanes} or town.edges.shape[1] != len(town.edge_types):
        yield f"the columns of town {town.name!r} have different lengths"
