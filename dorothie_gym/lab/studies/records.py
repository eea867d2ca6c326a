"""Records of a study folder: participants, answers, groups, sessions, invitations, ids of the recruiting platform."""

from __future__ import annotations

import hashlib
import json
import secrets
import sqlite3
import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.lab.studies.database import Database
from dorothie_gym.lab.studies.record_types import (
    DATABASE_FILE,
    RECRUITMENT_FILE,
    RECRUITMENT_SCHEMA,
    SCHEMA,
    SESSIONS_FOLDER,
    Group,
    Participant,
    SessionRow,
)
from dorothie_gym.lab.studies.stages import Outcome, Stage
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.assignment import Slot
    from dorothie_gym.lab.studies.items import Answer

ABANDONED_SECONDS: Final = 1800.0
"""Time without a sign of a person before the consent after which the person's data are deleted [s]."""

WITHDRAWN: Final = "withdrawn"
"""Reason of the end of a session whose record was deleted."""


class StudyRecords:
    """Records of a study folder.

    Args:
        folder: the folder, created for its owner only if it is missing.
        writable: whether records are changed; otherwise the folder must exist.

    Attributes:
        folder: see above.
        data: pseudonymous data.
        recruitment: ids of the recruiting platform.

    Raises:
        SessionError: a database is missing or damaged.
    """

    def __init__(self, folder: Path, *, writable: bool = True) -> None:
        self.folder = folder
        if writable:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            (folder / SESSIONS_FOLDER).mkdir(exist_ok=True)
        self.data = Database(folder / DATABASE_FILE, SCHEMA, writable=writable)
        self.recruitment = Database(folder / RECRUITMENT_FILE, RECRUITMENT_SCHEMA, writable=writable)

    def close(self) -> None:
        """Closes the files."""
        self.data.close()
        self.recruitment.close()

    def transaction(self) -> AbstractContextManager[None]:
        """Makes the changes of a block to the pseudonymous data in one step."""
        return self.data.transaction()

    # --- participants -----------------------------------------------------------------------------------------------

    def add_participant(
        self, parameters: Mapping[str, str], *, invitation: str | None = None, visit: str | None = None
    ) -> tuple[str, str]:
        """Adds a person before the consent; returns the id and the secret of the person's browser.

        Args:
            parameters: parameters of the link, which are kept apart.
            invitation: token of an invitation, which is then used.
            visit: random text of the browser's tab.
        """
        secret, name = secrets.token_urlsafe(32), self._new_id()
        with self.recruitment.transaction():  # first: rows without a participant are removed at the next start
            for key, value in parameters.items():
                self.recruitment.run("INSERT INTO parameters VALUES (?, ?, ?)", name, key, value)
        with self.data.transaction():
            number = 1 + (self.data.value("SELECT max(number) FROM participants") or 0)
            self.data.run(
                "INSERT INTO participants (id, secret, stage, seen, number) VALUES (?, ?, ?, ?, ?)",
                name,
                digest(secret),
                Stage.CONSENT.value,
                time.time(),
                number,
            )
            used, tab = (None if text is None else digest(text) for text in (invitation, visit))
            self.data.run("UPDATE invitations SET used = 1 WHERE token = ?", used)
            self.data.run("INSERT INTO visits VALUES (?, ?, ?)", name, used, tab)
        return name, secret

    def _new_id(self) -> str:
        """Returns an unused random id, which reveals nothing about the person or the order of arrival."""
        while True:
            name = "P" + "".join(secrets.choice("23456789ABCDEFGHJKLMNPQRSTUVWXYZ") for _ in range(7))
            if self.participant(name) is None:
                return name

    def participant(self, name: str) -> Participant | None:
        """Returns a participant by id; None if there is none."""
        found = self.data.row("SELECT * FROM participants WHERE id = ?", name)
        return None if found is None else _participant(found)

    def participants(self) -> list[Participant]:
        """Returns all participants by id, so that their order says nothing about them."""
        return [_participant(row) for row in self.data.rows("SELECT * FROM participants ORDER BY id")]

    def stage_counts(self) -> dict[Stage, int]:
        """Returns the number of participants at each stage with participants."""
        rows = self.data.rows("SELECT stage, count(*) AS number FROM participants GROUP BY stage")
        return {Stage(row["stage"]): row["number"] for row in rows}

    def find_secret(self, secret: str) -> str | None:
        """Returns the id of the participant whose browser has a secret; None if there is none."""
        name: str | None = self.data.value("SELECT id FROM participants WHERE secret = ?", digest(secret))
        return name

    def find_platform_id(self, key: str, value: str) -> str | None:
        """Returns the id of the participant whose link had a parameter; None if there is none."""
        query = "SELECT participant FROM parameters WHERE name = ? AND value = ?"
        names = [row["participant"] for row in self.recruitment.rows(query, key, value)]
        return next((name for name in names if self.participant(name) is not None), None)  # an entry may have failed

    def find_visit(self, visit: str) -> str | None:
        """Returns the id of the participant at the consent whom a tab has brought; None if there is none."""
        name: str | None = self.data.value(
            "SELECT id FROM visits JOIN participants ON id = participant WHERE visit = ? AND stage = ?",
            digest(visit),
            Stage.CONSENT.value,
        )
        return name

    def renew_secret(self, name: str) -> str:
        """Returns a new secret for the browser of a participant; the old one is void."""
        secret = secrets.token_urlsafe(32)
        self.data.run("UPDATE participants SET secret = ?, seen = ? WHERE id = ?", digest(secret), time.time(), name)
        return secret

    def platform_ids(self, name: str, key: str) -> list[str]:
        """Returns the values of a parameter of a participant's link."""
        rows = self.recruitment.rows("SELECT value FROM parameters WHERE participant = ? AND name = ?", name, key)
        return [row["value"] for row in rows]

    def find_person(self, given: str, key: str | None) -> str | None:
        """Returns the id of a participant by id, or by the parameter `key` of the link; None if there is none."""
        if self.participant(given) is not None:
            return given
        return None if key is None else self.find_platform_id(key, given)

    def see(self, name: str) -> None:
        """Records a sign of a participant's browser."""
        self.data.run("UPDATE participants SET seen = ? WHERE id = ?", time.time(), name)

    def undecided(self) -> list[str]:
        """Returns the ids of the people who neither agreed nor declined and have not been seen for long."""
        limit = time.time() - ABANDONED_SECONDS
        rows = self.data.rows("SELECT id FROM participants WHERE stage = ? AND seen < ?", Stage.CONSENT.value, limit)
        return [row["id"] for row in rows]

    def number(self, name: str) -> int:
        """Returns the number of a participant in the order of arrival; it never leaves the server."""
        return int(self.data.value("SELECT number FROM participants WHERE id = ?", name))

    def set_role(self, name: str, role: Role) -> None:
        """Gives a participant a role."""
        self.data.run("UPDATE participants SET role = ? WHERE id = ?", role.value, name)

    def set_stage(
        self, name: str, stage: Stage, *, outcome: Outcome | None = None, position: int | None = None
    ) -> None:
        """Moves a participant to a stage.

        Args:
            name: id of the participant.
            stage: the stage.
            outcome: outcome of the participation, if it is known now.
            position: number of the next session, if it changes.
        """
        with self.data.transaction():
            self.data.run("UPDATE participants SET stage = ? WHERE id = ?", stage.value, name)
            self.data.run("INSERT INTO marks VALUES (?, ?, ?)", name, stage.value, time.time())
            if outcome is not None:
                self.set_outcome(name, outcome)
            if position is not None:
                self.data.run("UPDATE participants SET position = ? WHERE id = ?", position, name)

    def set_outcome(self, name: str, outcome: Outcome) -> None:
        """Sets the outcome of a participation."""
        self.data.run("UPDATE participants SET outcome = ? WHERE id = ?", outcome.value, name)

    def answer(self, name: str, questionnaire: str, position: int, answers: Mapping[str, Answer]) -> None:
        """Stores the answers of a participant to a questionnaire."""
        with self.data.transaction():
            for item, value in answers.items():
                self.data.run(
                    "INSERT OR REPLACE INTO answers VALUES (?, ?, ?, ?, ?)",
                    name,
                    questionnaire,
                    position,
                    item,
                    json.dumps(value, ensure_ascii=False),
                )

    # --- invitations ------------------------------------------------------------------------------------------------

    def invite(self, count: int) -> list[str]:
        """Returns new tokens of invitations; only their hashes are stored."""
        tokens = [secrets.token_urlsafe(16) for _ in range(count)]
        with self.data.transaction():
            for token in tokens:
                self.data.run("INSERT INTO invitations (token) VALUES (?)", digest(token))
        return tokens

    def is_unused(self, token: str) -> bool:
        """Returns whether a token is valid and unused."""
        query = "SELECT 1 FROM invitations WHERE token = ? AND used = 0"
        return self.data.row(query, digest(token)) is not None

    def free_invitation(self, name: str) -> None:
        """Makes the invitation of a participant who has given no consent valid again."""
        query = "SELECT invitation FROM visits WHERE participant = ?"
        self.data.run(f"UPDATE invitations SET used = 0 WHERE token = ({query})", name)

    def readmit(self, name: str) -> str:
        """Returns a token with which a participant can continue in another browser; only its hash is stored."""
        token = secrets.token_urlsafe(16)
        self.data.run("INSERT OR REPLACE INTO readmissions VALUES (?, ?, NULL)", name, digest(token))
        return token

    def is_unused_readmission(self, token: str) -> bool:
        """Returns whether a token lets a participant continue in another browser."""
        query = "SELECT 1 FROM readmissions WHERE token = ? AND visit IS NULL"
        return self.data.row(query, digest(token)) is not None

    def use_readmission(self, token: str, visit: str | None) -> str | None:
        """Uses a token up; returns the id of its participant, or None if it is not valid.

        Args:
            token: the token.
            visit: random text of the tab, for which the token stays valid.
        """
        tab = digest(visit if visit is not None else secrets.token_urlsafe(16))
        with self.data.transaction():
            name: str | None = self.data.value(
                "SELECT participant FROM readmissions WHERE token = ? AND (visit IS NULL OR visit = ?)",
                digest(token),
                tab,
            )
            if name is not None:
                self.data.run("UPDATE readmissions SET visit = ? WHERE participant = ?", tab, name)
        return name

    # --- groups and sessions ----------------------------------------------------------------------------------------

    def taken_slots(self) -> set[int]:
        """Returns the slots of groups that are in progress or have completed their sessions."""
        return {row["slot"] for row in self.data.rows("SELECT slot FROM groups WHERE state != 'broken'")}

    def add_group(self, slot: Slot, members: Mapping[Role, str]) -> Group:
        """Adds a group and its sessions."""
        with self.data.transaction():
            self.data.run("INSERT INTO groups (slot, state) VALUES (?, 'playing')", slot.number)
            number = int(self.data.value("SELECT last_insert_rowid()"))
            for role, name in members.items():
                self.data.run("INSERT INTO members VALUES (?, ?, ?)", number, name, role.value)
            plan = zip(slot.conditions, slot.scenarios, slot.seeds, strict=True)
            for position, (condition, scenario, seed) in enumerate(plan):
                self.data.run(
                    "INSERT INTO sessions (id, group_id, position, condition, town, storyboard, seed) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?)",
                    f"S{number:05d}-{position + 1:02d}",
                    number,
                    position,
                    condition,
                    scenario.town,
                    scenario.storyboard,
                    seed,
                )
        return Group(id=number, slot=slot.number, members=dict(members))

    def group_of(self, name: str) -> Group | None:
        """Returns the last group of a participant that has not been dissolved; None if there is none."""
        found = self.data.value("SELECT max(group_id) FROM members WHERE participant = ?", name)
        return None if found is None else self.group(found)

    def group(self, number: int) -> Group:
        """Returns a group with the members that have not withdrawn."""
        rows = self.data.rows("SELECT role, participant FROM members WHERE group_id = ?", number)
        slot = self.data.value("SELECT slot FROM groups WHERE id = ?", number)
        return Group(id=number, slot=slot, members={Role(row["role"]): row["participant"] for row in rows})

    def is_broken(self, group: int) -> bool:
        """Returns whether a group lost a member, so that it plays no further session."""
        return bool(self.data.value("SELECT state FROM groups WHERE id = ?", group) == "broken")

    def set_group_state(self, group: int, state: str) -> None:
        """Sets the state of a group: "playing", "completed" or "broken"."""
        self.data.run("UPDATE groups SET state = ? WHERE id = ?", state, group)

    def dissolve(self, group: int) -> None:
        """Removes a group whose first session has not begun."""
        with self.data.transaction():
            self.data.run("DELETE FROM sessions WHERE group_id = ?", group)
            self.data.run("DELETE FROM groups WHERE id = ?", group)

    def sessions(self, group: int | None = None) -> list[SessionRow]:
        """Returns the sessions of a group, or of all groups, in order."""
        rows = self.data.rows("SELECT * FROM sessions WHERE ? IS NULL OR group_id = ? ORDER BY id", group, group)
        return [
            SessionRow(
                id=row["id"],
                group=row["group_id"],
                position=row["position"],
                condition=row["condition"],
                town=row["town"],
                storyboard=row["storyboard"],
                seed=row["seed"],
                folder=row["folder"],
                reason=row["reason"],
            )
            for row in rows
        ]

    def set_folder(self, session: str, folder: str | None) -> None:
        """Records the folder of a session's recording; a withdrawn session keeps none."""
        self.data.run(
            "UPDATE sessions SET folder = ? WHERE id = ? AND (? IS NULL OR reason IS NOT ?)",
            folder,
            session,
            folder,
            WITHDRAWN,
        )

    def finish_session(self, session: str, reason: str, *, success: bool | None, seconds: float | None) -> None:
        """Records the end of a session; a withdrawn session stays withdrawn."""
        self.data.run(
            "UPDATE sessions SET reason = ?, success = ?, seconds = ? WHERE id = ? AND reason IS NOT ?",
            reason,
            None if success is None else int(success),
            seconds,
            session,
            WITHDRAWN,
        )

    # --- erasure ----------------------------------------------------------------------------------------------------

    def erase_later(self, sessions: Sequence[str]) -> None:
        """Records sessions whose recordings must be removed, also after a crash."""
        for session in sessions:
            self.data.run("INSERT OR IGNORE INTO erasures VALUES (?)", session)

    def pending_erasures(self) -> list[str]:
        """Returns the ids of the sessions whose records must be removed."""
        return [row["folder"] for row in self.data.rows("SELECT folder FROM erasures ORDER BY folder")]

    def erased(self, session: str) -> None:
        """Records that all data of a session are removed."""
        self.data.run("DELETE FROM erasures WHERE folder = ?", session)


def _participant(row: sqlite3.Row) -> Participant:
    return Participant(
        id=row["id"],
        role=None if row["role"] is None else Role(row["role"]),
        stage=Stage(row["stage"]),
        position=row["position"],
        outcome=None if row["outcome"] is None else Outcome(row["outcome"]),
        seen=row["seen"],
    )


def digest(secret: str) -> bytes:
    """Returns the hash of a random secret, as which it is stored."""
    return hashlib.sha256(secret.encode()).digest()
