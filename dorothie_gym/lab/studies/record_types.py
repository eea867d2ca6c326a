"""Files of a study folder, tables of its databases, and their rows as objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from dorothie_gym.lab.studies.stages import Outcome, Stage
from dorothie_gym.ontology.roles import Role

STUDY_FILE: Final = "study.yaml"
"""Copy of the study file."""

SESSIONS_FOLDER: Final = "sessions"
"""Folder of the recorded sessions."""

DATABASE_FILE: Final = "study.sqlite"
"""Pseudonymous data."""

RECRUITMENT_FILE: Final = "recruitment.sqlite"
"""Ids of the recruiting platform: the only link between data and people. It is never exported."""

SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS participants (
    id TEXT PRIMARY KEY, secret BLOB NOT NULL UNIQUE, role TEXT, stage TEXT NOT NULL,
    position INTEGER NOT NULL DEFAULT 0, outcome TEXT, seen REAL NOT NULL, number INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS marks (
    participant TEXT NOT NULL REFERENCES participants(id) ON DELETE CASCADE, stage TEXT NOT NULL, at REAL NOT NULL);
CREATE TABLE IF NOT EXISTS answers (
    participant TEXT NOT NULL REFERENCES participants(id) ON DELETE CASCADE, questionnaire TEXT NOT NULL,
    position INTEGER NOT NULL, item TEXT NOT NULL, value TEXT NOT NULL,
    PRIMARY KEY (participant, questionnaire, position, item));
CREATE TABLE IF NOT EXISTS groups (
    id INTEGER PRIMARY KEY, slot INTEGER NOT NULL, state TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS members (
    group_id INTEGER NOT NULL REFERENCES groups(id) ON DELETE CASCADE,
    participant TEXT NOT NULL REFERENCES participants(id) ON DELETE CASCADE, role TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS sessions (
    id TEXT PRIMARY KEY, group_id INTEGER NOT NULL REFERENCES groups(id), position INTEGER NOT NULL,
    condition TEXT NOT NULL, town TEXT NOT NULL, storyboard TEXT, seed INTEGER NOT NULL, folder TEXT, reason TEXT,
    success INTEGER, seconds REAL);
CREATE TABLE IF NOT EXISTS invitations (token BLOB PRIMARY KEY, used INTEGER NOT NULL DEFAULT 0);
CREATE TABLE IF NOT EXISTS visits (
    participant TEXT PRIMARY KEY REFERENCES participants(id) ON DELETE CASCADE, invitation BLOB, visit BLOB);
CREATE TABLE IF NOT EXISTS readmissions (
    participant TEXT PRIMARY KEY REFERENCES participants(id) ON DELETE CASCADE, token BLOB NOT NULL UNIQUE,
    visit BLOB);
CREATE TABLE IF NOT EXISTS erasures (folder TEXT PRIMARY KEY);
"""

RECRUITMENT_SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS parameters (
    participant TEXT NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (participant, name));
"""


@dataclass(frozen=True, kw_only=True)
class Participant:
    """Participant.

    Attributes:
        id: pseudonymous id.
        role: role in the sessions; None before the instructions.
        stage: current stage.
        position: number of the next session of the participant's group, or of the current one.
        outcome: outcome; None before the end.
        seen: time at which the browser was last heard of [s since 1970].
    """

    id: str
    role: Role | None
    stage: Stage
    position: int
    outcome: Outcome | None
    seen: float


@dataclass(frozen=True, kw_only=True)
class Group:
    """Group of people who play together: its number, slot, and participant of each role."""

    id: int
    slot: int
    members: Mapping[Role, str]


@dataclass(frozen=True, kw_only=True)
class SessionRow:
    """Session of a group.

    Attributes:
        id: name in exports.
        group: number of the group.
        position: number among the group's sessions, from 0.
        condition: name of the condition.
        town: town, by name or file.
        storyboard: storyboard, by name or file; None for one that the seed draws.
        seed: seed.
        folder: name of the folder of the record; None before the start, and after a deletion.
        reason: reason of the end; None before.
    """

    id: str
    group: int
    position: int
    condition: str
    town: str
    storyboard: str | None
    seed: int
    folder: str | None
    reason: str | None
