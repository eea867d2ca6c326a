"""Writes the transcripts that the recogniser's language model is made of: utterances of generated sessions.

    dorothie-gym generate --sessions 240 --seed 21001 --out CORPUS
    python benchmarks/speech_transcripts.py CORPUS

Sessions that measure recognition have other seeds (`python -m benchmarks speech`).
"""

from __future__ import annotations

import argparse
import gzip
from pathlib import Path

from dorothie_gym.archive.corpus import load_sessions
from dorothie_gym.speech.grammar_sentences import TRANSCRIPTS_FILE
from dorothie_gym.support.files import write_atomically

TARGET = Path(__file__).parent.parent / "dorothie_gym" / "speech" / "data" / TRANSCRIPTS_FILE


def utterances(corpus: Path) -> list[str]:
    """Returns the utterances of all sessions of a corpus, their spans separated by " | "."""
    found = []
    for session in load_sessions(corpus):
        for utterance in session.utterances():
            found.append(" | ".join(move.span for move in utterance.moves))
    return found


def main() -> None:
    """Writes the transcripts of a corpus into the package."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    lines = utterances(parser.parse_args().corpus)
    content = gzip.compress("".join(f"{line}\n" for line in lines).encode(), mtime=0)
    write_atomically(TARGET, content)
    print(f"{len(lines)} utterances, {len(content) / 1000:.0f} kB: {TARGET}")


if __name__ == "__main__":
    main()
