"""Generates a small corpus, prints its statistics, and draws the distribution of dialogue moves.

The same statistics for any corpus are available as `dorothie-gym stats CORPUS`. Six sessions take about 30 seconds. A
second run reuses the corpus.

    python examples/corpus_analysis.py --sessions 6 --out my_corpus
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from dorothie_gym import EnvConfig
from dorothie_gym.archive import Corpus
from dorothie_gym.evaluation.analysis import corpus_stats_of
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.ontology import DialogueMove, Role

SPEAKERS = {Role.PARTICIPANT: "participant", Role.CO_WIZARD: "Co-Wizard"}


def draw_moves(corpus: Corpus, file: Path) -> None:
    """Draws the share of each dialogue move among the moves of each speaker."""
    counts = {role: Counter(move.act.move for session in corpus for move in session.moves(role)) for role in SPEAKERS}
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(DialogueMove))
    for k, (role, label) in enumerate(SPEAKERS.items()):
        shares = [counts[role][move] / max(1, counts[role].total()) for move in DialogueMove]
        axes.bar(places + 0.4 * k - 0.2, shares, width=0.4, label=label)
    axes.set_xticks(places, [move.label for move in DialogueMove], rotation=45, ha="right")
    axes.set_ylabel("share of the speaker's moves")
    axes.legend(frameon=False)
    figure.savefig(file, dpi=150)


def main() -> None:
    """Generates (or reuses) a corpus and analyses it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("my_corpus"), help="folder of the corpus")
    parser.add_argument("--sessions", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=900.0, help="longest session [simulated seconds]")
    options = parser.parse_args()

    config = EnvConfig(max_seconds=options.seconds)
    generate_corpus(options.out, sessions=options.sessions, seed=options.seed, config=config)
    corpus = Corpus.load(options.out)
    for key, value in corpus_stats_of(corpus).counts.to_json().items():
        print(f"{key:28}{value:.3f}" if isinstance(value, float) else f"{key:28}{value}")
    words = [len(utterance.text.split()) for session in corpus for utterance in session.utterances()]
    print(f"{'words per utterance':28}{np.mean(words):.2f}")
    draw_moves(corpus, options.out / "moves.png")
    print(f"chart: {options.out / 'moves.png'}")


if __name__ == "__main__":
    main()
