"""Understanding of everyday sentences to a driver: moves, slots and plans, beside hand-made labels.

The sentences and their labels are in `benchmarks/people/*.jsonl`, one JSON object a line; no rule was written for those
of the split "test".
"""

from __future__ import annotations

import json
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.timing import Figures, Progress, ignore_progress, machine, rounded
from dorothie_gym.dialogue import (
    AsrChannel,
    DrivingPlan,
    Span,
    TextHypothesis,
    guess_spans,
    read_hypotheses,
    understand,
)
from dorothie_gym.errors import SettingsError
from dorothie_gym.ontology import DialogueAct, DialogueMove, parse_act

FOLDER: Final = Path(__file__).parent / "people"
"""Folder of the labelled sentences."""

WORD_ERRORS: Final = 0.2
"""Word error rate of the second measurement."""

ORDERING: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.CLARIFY, DialogueMove.REPLY_W, DialogueMove.REPLY_Y})
"""Moves with which a listener carries out what the words ask for."""


@dataclass(frozen=True, kw_only=True)
class LabelledSentence:
    """Sentence with its labels.

    Attributes:
        kind: kind of sentence, such as "lane" or "stop".
        before: words of the other speaker before it; "" without any.
        text: the sentence.
        acts: acts of its spans.
        plan: steps that it asks for.
    """

    kind: str
    before: str
    text: str
    acts: tuple[DialogueAct, ...]
    plan: DrivingPlan


def read_sentences(folder: Path = FOLDER, split: str | None = None) -> list[LabelledSentence]:
    """Returns the labelled sentences of a folder.

    Args:
        folder: folder with `sentences*.jsonl`.
        split: "dev" or "test"; None for both.

    Raises:
        SettingsError: there are none, or a line is malformed; names the file and the line.
    """
    found: list[LabelledSentence] = []
    for path in sorted(folder.glob("sentences*.jsonl")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if not line.strip():
                continue
            try:
                row = json.loads(line)
                if split is None or row["split"] == split:
                    found.append(_sentence(row))
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise SettingsError(f"{path}, line {number}: {error}; see the labels of the other lines") from error
    if not found:
        raise SettingsError(f"{folder}: has no sentences of the split {split or 'dev or test'} in sentences*.jsonl")
    return found


def _sentence(row: Mapping[str, object]) -> LabelledSentence:
    acts = row["acts"]
    if not isinstance(acts, list):
        raise TypeError("`acts` must be a list")
    return LabelledSentence(
        kind=str(row["kind"]),
        before=str(row["before"]),
        text=str(row["text"]),
        acts=tuple(parse_act(act["move"], act["slots"]) for act in acts),
        plan=DrivingPlan.from_json(row["plan"]),
    )


def measure(
    *, folder: Path = FOLDER, split: str | None = None, seed: int = 0, progress: Progress = ignore_progress
) -> Figures:
    """Compares the parsed sentences with their labels, as written and with word errors.

    Args:
        folder: folder with `sentences*.jsonl`.
        split: "dev" or "test"; None for both.
        seed: seed of the word errors.
        progress: callback for the progress.

    Returns:
        `written`, `misheard` (with WORD_ERRORS) and `hypotheses` (the same, read by all hypotheses), each with `kinds`
        and `all`: `sentences`, `first_move`, `moves` (the whole sequence), `first_move_and_slots`, `slots_precision`,
        `slots_recall`, `slots_f1`, `plan` (all steps equal) and `steps_f1`; `milliseconds`: median processor time of
        `guess_spans` and `understand`.

    Raises:
        SettingsError: there are no such sentences.
    """
    sentences = read_sentences(folder, split)
    channel = AsrChannel(rate=WORD_ERRORS)
    rng, again = np.random.default_rng(seed), np.random.default_rng(seed)
    understand("Turn left, please.")
    progress("written words", 0.1)
    times: list[float] = []
    written = _compare(sentences, lambda text, after: text, times)
    progress("misheard words", 0.6)
    return {
        "sentences": len(sentences),
        "split": split or "dev and test",
        "written": written,
        "misheard": _compare(sentences, lambda text, after: channel.transcribe(text, rng), []),
        "hypotheses": _compare(sentences, lambda text, after: _taken(channel.recognise(text, again), after), []),
        "word_errors": WORD_ERRORS,
        "milliseconds": rounded(1000.0 * float(np.median(times))),
        "machine": machine(),
    }


def _taken(hypotheses: Sequence[TextHypothesis], after: DialogueMove | None) -> str:
    """Returns the hypothesis that makes most sense; "" if nothing was heard."""
    return read_hypotheses(hypotheses, after).text if hypotheses else ""


def _compare(
    sentences: Sequence[LabelledSentence], hear: Callable[[str, DialogueMove | None], str], times: list[float]
) -> dict[str, object]:
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for sentence in sentences:
        after = guess_spans(sentence.before)[-1].act.move if sentence.before.strip() else None
        text = hear(sentence.text, after)
        begun = time.process_time()
        spans = guess_spans(text, after, sentence.before)
        plan = understand(text, sentence.before).plan
        times.append(time.process_time() - begun)
        compared = _counts(sentence, spans, plan)
        counts[sentence.kind].update(compared)
        counts["all"].update(compared)
    kinds = {kind: _shares(counts[kind]) for kind in sorted(counts) if kind != "all"}
    return {"all": _shares(counts["all"]), "kinds": kinds}


def _counts(sentence: LabelledSentence, spans: Sequence[Span], plan: DrivingPlan) -> Counter[str]:
    ordered = plan if any(span.act.move in ORDERING for span in spans) else DrivingPlan()
    wanted, heard = _values(sentence.acts), _values(span.act for span in spans)
    steps, read = Counter(sentence.plan.steps), Counter(ordered.steps)
    first = bool(spans) and spans[0].act.move is sentence.acts[0].move
    moves = [span.act.move for span in spans] == [act.move for act in sentence.acts]
    return Counter(
        sentences=1,
        first_move=int(first),
        moves=int(moves),
        first_move_and_slots=int(first and wanted == heard),
        slots_right=len(wanted & heard),
        slots_wanted=len(wanted),
        slots_heard=len(heard),
        plan=int(ordered == sentence.plan),
        steps_right=(steps & read).total(),
        steps_both=steps.total() + read.total(),
    )


def _values(acts: Iterable[DialogueAct]) -> frozenset[object]:
    return frozenset(value for act in acts for value in act.slots)


def _shares(counts: Counter[str]) -> dict[str, float]:
    number = counts["sentences"]
    shares = {name: counts[name] / number for name in ("first_move", "moves", "first_move_and_slots", "plan")}
    return {
        "sentences": number,
        **{name: rounded(share) for name, share in shares.items()},
        "slots_precision": _ratio(counts["slots_right"], counts["slots_heard"]),
        "slots_recall": _ratio(counts["slots_right"], counts["slots_wanted"]),
        "slots_f1": _ratio(2 * counts["slots_right"], counts["slots_heard"] + counts["slots_wanted"]),
        "steps_f1": _ratio(2 * counts["steps_right"], counts["steps_both"]),
    }


def _ratio(part: int, whole: int) -> float:
    """Returns a share; 1 of nothing."""
    return rounded(part / whole) if whole else 1.0
