"""Share of the utterances of a corpus that a grammar checker objects to, with its findings by rule.

The checker is Harper (https://writewithharper.com), which works offline: `pip install harper-py==0.2.0`. It is given
each utterance as it would be written down: with a capital and a full stop where the speaker's style has none, and
without the hesitations, restarts and withdrawn names that the record marks as meant (field `fluent`). The names of the
lexicon and of the people in the storyboards are words of its dictionary. No rule is switched off: findings of style
(`STYLE`) are counted apart.
"""

import importlib
import json
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from dorothie_gym.archive import Corpus
from dorothie_gym.cli.output import fail, reporting_errors
from dorothie_gym.dialogue import load_lexicon
from dorothie_gym.ontology import SLOT_VALUES, Slot
from dorothie_gym.session.recording import UtteranceRecord
from dorothie_gym.tasks.catalogue import catalogue

STYLE: Final = frozenset({"Enhancement", "Formatting", "Readability", "Redundancy", "Regionalism", "Style"})
"""Kinds of findings that concern the style of written English, and not its grammar."""

EXAMPLES = 3
"""Number of utterances printed for each rule."""

_WORD = re.compile(r"[A-Z][\w'-]+")


def written(utterance: UtteranceRecord) -> str:
    """Returns the words of an utterance without its disfluencies, with a capital and a full stop."""
    text = " ".join(move.fluent or move.span for move in utterance.moves).strip(" ,")
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?", "!")) else ".")


def _names(corpus: Corpus) -> list[str]:
    """Returns the names of places and streets, and those of people in the catalogue and in the stories."""
    lexicon = load_lexicon()
    texts = [
        text
        for slot in (Slot.LANDMARK, Slot.STREET)
        for value in SLOT_VALUES[slot]
        for form in ("say", "also")
        for text in lexicon.phrases[value].get(form, ())
    ]
    texts += [name for kind in catalogue().values() for listed in kind.attributes.values() for name in listed]
    texts += [subgoal["description"] for session in corpus for subgoal in session.header.subgoals]
    names = {word.removesuffix("'s") for text in texts for word in _WORD.findall(text)}
    return sorted(names | {f"{name}'s" for name in names})


def _linter(names: list[str]) -> Any:
    try:
        harper = importlib.import_module("harper")
    except ModuleNotFoundError:
        fail("the grammar checker is not installed; run: pip install harper-py==0.2.0")
    linter = harper.Linter(harper.Dialect.AMERICAN)
    linter.import_words(names)
    return linter


def main(
    corpus: Annotated[Path, typer.Argument(help="folder of the corpus")],
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Prints the share of utterances that are flagged, and the findings by rule."""
    with reporting_errors():
        sessions = Corpus.load(corpus)
        linter = _linter(_names(sessions))
        texts = Counter(written(said) for session in sessions for said in session.utterances())
        rules: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
        flagged: Counter[str] = Counter()
        for text, times in track(texts.items(), "checking", console=Console(stderr=True)):
            found = {
                (lints[0].lint_kind, rule)
                for rule, lints in linter.organized_lints(text, language="plaintext").items()
                if lints
            }
            for key in found:
                rules[key][text] += times
            flagged["style"] += times * any(kind in STYLE for kind, _ in found)
            flagged["grammar"] += times * any(kind not in STYLE for kind, _ in found)
    total = texts.total()
    shares = {name: flagged[name] / total if total else 0.0 for name in ("grammar", "style")}
    ranked = sorted(rules.items(), key=lambda item: (item[0][0] in STYLE, -item[1].total(), item[0]))
    if as_json:
        listed = [
            {
                "rule": rule,
                "kind": kind,
                "utterances": found.total(),
                "examples": [text for text, _ in found.most_common(EXAMPLES)],
            }
            for (kind, rule), found in ranked
        ]
        print(json.dumps({"utterances": total, "distinct": len(texts), **shares, "rules": listed}))
        return
    print(f"{total:,} utterances, flagged for grammar {shares['grammar']:.2%}, for style {shares['style']:.2%}")
    table = Table("kind", "rule", "utterances", "examples")
    for (kind, rule), flagged_texts in ranked:
        examples = "\n".join(text for text, _ in flagged_texts.most_common(EXAMPLES))
        table.add_row(kind, rule, str(flagged_texts.total()), examples)
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
