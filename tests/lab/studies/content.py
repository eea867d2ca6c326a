"""Small studies for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

STUDY: dict[str, Any] = {
    "title": "A small study",
    "contact": "laboratory@example.org",
    "conditions": [
        {"name": "exact", "co_wizard": "human"},
        {"name": "noisy", "co_wizard": "human", "word_error_rate": 0.2},
    ],
    "scenarios": [{"town": "brookside", "storyboard": "lunch_break"}, {"town": "brookside"}],
    "session": {"max_seconds": 5.0, "pictures": False},
    "tutorial": {"seconds": 5.0},
    "waiting_room": {"seconds": 60.0},
    "absence": {"seconds": 1.0, "then": "end"},
    "consent": {"text": "We record what you do.", "statements": ["I agree.", "I am an adult."]},
    "texts": {
        "instructions": {"participant": "Tell the car where to go.", "co_wizard": "Drive the car."},
        "debriefing": "Thank you.",
    },
    "questionnaires": {
        "before": [{"id": "age", "kind": "number", "text": "Age?", "min": 18, "max": 99}],
        "after": [
            {"id": "trust", "kind": "likert", "text": "I trusted the other one."},
            {"id": "comment", "kind": "text", "text": "Comments?", "required": False},
        ],
    },
    "recruitment": {
        "completion": {"code": "FINISHED", "url": "https://recruiting.example.org/done"},
        "no_partner": {"code": "WAITED"},
    },
}
"""Study with two people in short sessions."""

SOLO = {
    **STUDY,
    "conditions": [{"name": "alone"}],
    "texts": {"instructions": {"participant": "Tell the car where to go."}, "debriefing": "Thank you."},
}
"""Study with one person in each session."""


def write_study(folder: Path, content: dict[str, Any]) -> Path:
    """Writes a study file; returns its path."""
    file = folder / "study.yaml"
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return file
