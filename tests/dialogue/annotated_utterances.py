"""Hand-written utterances with annotated acts, and the accuracy of the dialogue act classifier on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from dorothie_gym.dialogue import guess_act
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role, parse_act, parse_move

DATA = Path(__file__).parent / "data"


@dataclass(frozen=True)
class Annotated:
    speaker: Role
    after: DialogueMove | None
    spans: tuple[str, ...]
    acts: tuple[DialogueAct, ...]

    @property
    def text(self) -> str:
        return " ".join(self.spans)


@dataclass(frozen=True)
class Score:
    moves: float
    f1: float
    wrong: tuple[str, ...]


def read_act(label: str) -> DialogueAct:
    move, *slots = label.split()
    return parse_act(move, {name: values.split(",") for name, _, values in (slot.partition("=") for slot in slots)})


def read_annotated(name: str) -> list[Annotated]:
    found = []
    for row in yaml.safe_load((DATA / f"heard_{name}.yaml").read_text(encoding="utf-8")):
        spans, acts = tuple(row["says"]), tuple(read_act(label) for label in row["acts"])
        assert len(spans) == len(acts), row
        after = parse_move(row["after"]) if "after" in row else None
        found.append(Annotated(Role(row["by"]), after, spans, acts))
    return found


def score(annotated: Sequence[Annotated], guess: Callable[..., DialogueAct] = guess_act, context: bool = True) -> Score:
    """Returns move accuracy and micro-averaged slot F1 over annotated spans."""
    right = total = 0
    slots: Counter[str] = Counter()
    wrong = []
    for item in annotated:
        for place, (span, act) in enumerate(zip(item.spans, item.acts, strict=True)):
            found = guess(span, item.after if context and place == 0 else None)
            total += 1
            right += found.move is act.move
            slots["hit"] += len(found.slots & act.slots)
            slots["both"] += len(found.slots) + len(act.slots)
            if found != act:
                wrong.append(f"{'M' if found.move is not act.move else ' '} {span!r}: {act} heard as {found}")
    return Score(right / total, 2 * slots["hit"] / slots["both"], tuple(wrong))
