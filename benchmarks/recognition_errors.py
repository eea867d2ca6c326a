"""Measures the recognition errors of spoken sessions, and writes the profile that the text channel imitates.

    dorothie-gym generate --speech --sessions 60 --seed 4021 --out CORPUS
    python benchmarks/recognition_errors.py CORPUS

The sessions have another seed than those of the language model (`benchmarks/speech_transcripts.py`).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from dorothie_gym._version import __version__
from dorothie_gym.archive.corpus import load_sessions
from dorothie_gym.dialogue.recognition_errors import PROFILE_FILE
from dorothie_gym.evaluation.analysis.word_errors import WordErrorCounts, WordErrors
from dorothie_gym.support.files import write_atomically

TARGET: Final = Path(__file__).parent.parent / "dorothie_gym" / "dialogue" / "data" / PROFILE_FILE

PRIOR: Final = 200.0
"""Words of the mean error rate that are added to every class, so that small classes do not get extreme rates."""


def profile(counts: WordErrorCounts, sessions: int) -> dict[str, object]:
    """Returns the content of the data file."""
    total = counts.total
    if not total.errors:
        raise SystemExit("the sessions have no word errors, or were not spoken: generate them with --speech")
    return {
        "measured": f"{sessions} spoken sessions of dorothie_gym {__version__}; benchmarks/recognition_errors.py",
        "words": total.words,
        "word_error_rate": round(total.rate, 4),
        "substitutions": round(total.substitutions / total.errors, 3),
        "deletions": round(total.deletions / total.errors, 3),
        "speakers": relative({role.value: errors for role, errors in counts.speakers.items()}, total.rate),
        "noises": relative({noise.value: errors for noise, errors in counts.noises.items()}, total.rate),
        "word_classes": relative({kind.value: errors for kind, errors in counts.classes.items()}, total.rate),
    }


def relative(rows: Mapping[str, WordErrors], rate: float) -> dict[str, float]:
    """Returns the error rates of classes relative to the mean, drawn towards it by `PRIOR` words."""
    return {
        name: round((errors.errors + PRIOR * rate) / (errors.words + PRIOR) / rate, 3)
        for name, errors in sorted(rows.items())
    }


def main() -> None:
    """Measures a corpus and writes the profile into the package."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--out", type=Path, default=TARGET)
    asked = parser.parse_args()
    counts, sessions = WordErrorCounts(), 0
    for session in load_sessions(asked.corpus):
        counts.add(session)
        sessions += 1
    found = profile(counts, sessions)
    write_atomically(asked.out, (json.dumps(found, indent=2) + "\n").encode())
    print(json.dumps({**found, "counts": counts.to_json()}, indent=2))


if __name__ == "__main__":
    main()
