"""Vocabularies of the tool in the browser: the decision tree, moves with their keys, slots, and units."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.ontology.dialogue_acts import (
    DECISION_TREE,
    VECTOR_SLOTS,
    DialogueMove,
    DialogueUnit,
    Node,
    Question,
    path_to,
)
from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.slots import SLOT_VALUES, LandmarkName

MOVE_KEYS: Mapping[DialogueMove, str] = complete(
    {
        DialogueMove.IRRELEVANT: "z",
        DialogueMove.INSTRUCT: "i",
        DialogueMove.EXPLAIN: "e",
        DialogueMove.ALIGN: "a",
        DialogueMove.CHECK: "c",
        DialogueMove.QUERY_YN: "q",
        DialogueMove.QUERY_W: "w",
        DialogueMove.ACKNOWLEDGE: "o",
        DialogueMove.CONFUSE: "u",
        DialogueMove.CLARIFY: "l",
        DialogueMove.CONFIRM: "f",
        DialogueMove.REPLY_Y: "y",
        DialogueMove.REPLY_N: "n",
        DialogueMove.REPLY_U: "d",
        DialogueMove.REPLY_W: "v",
    },
    DialogueMove,
    "MOVE_KEYS",
    __name__,
)
"""Key of each move: mostly a letter of its name, else of a typical word ("okay", "huh", "don't know")."""


@lru_cache(maxsize=1)
def vocabulary() -> dict[str, Any]:
    """Returns all vocabularies in JSON types."""
    return {
        "tree": _tree(DECISION_TREE),
        "moves": [
            [move.label, MOVE_KEYS[move], [answer.label for _, answer in path_to(move)]] for move in DialogueMove
        ],
        "slots": {slot.label: [value.label for value in SLOT_VALUES[slot]] for slot in VECTOR_SLOTS},
        "exceptions": [str(kind) for kind in Handled],
        "exchange_ends": [str(end) for end in DialogueUnit.EXCHANGE.ends],
        "transaction_ends": [str(end) for end in DialogueUnit.TRANSACTION.ends],
        "goals": [name.label for name in LandmarkName if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED)],
    }


def _tree(node: Node) -> dict[str, Any] | str:
    """Returns a question with its answers, or the label of a move."""
    if not isinstance(node, Question):
        return node.label
    return {"text": node.text, "answers": [[answer.label, _tree(answer.next)] for answer in node.answers]}
