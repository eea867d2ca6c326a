"""SQLite databases of a study folder: durable transactions, and deletion that leaves no copies.

SQLite is used rather than logs in JSON because one step of a study changes several records at once (a group, its
session, and the stage of two people), and because deletion must not rewrite files by hand. With the rollback journal
and `synchronous=FULL`, a transaction that was committed survives the death of the process and a power failure. There is
no write-ahead log, which would keep deleted rows for a while.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from dorothie_gym.errors import SessionError

BUSY_SECONDS: Final = 10.0
"""Time that a command waits for the server, or the server for a command [s]."""

LOCK_FILE: Final = "run.lock"
"""Empty file by which one process at a time has a study folder."""


_PRAGMAS: Final = (
    "journal_mode=DELETE",
    "synchronous=FULL",
    "secure_delete=ON",
    "foreign_keys=ON",
    "temp_store=MEMORY",
)
"""Settings of each connection; temporary tables in memory, so that no copies lie in other folders."""


class StorageError(SessionError):
    """A database cannot be read or written at the moment: the disk is full or fails, or the database is locked."""


class Database:
    """SQLite database in a file that only its owner can read.

    Args:
        path: the file, created if it is missing.
        schema: statements that create the tables if they are missing.
        writable: whether it is opened for writing; otherwise the file must exist.

    Raises:
        SessionError: the file is missing, damaged, or no database.
    """

    def __init__(self, path: Path, schema: str, *, writable: bool = True) -> None:
        self.path = path
        if writable:
            with contextlib.suppress(FileExistsError):
                os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        elif not path.is_file():
            raise SessionError(f"{path}: does not exist; give the folder of a study")
        self._connection = sqlite3.connect(path, timeout=BUSY_SECONDS, isolation_level=None)
        self._connection.row_factory = sqlite3.Row
        try:
            for pragma in _PRAGMAS:
                self._connection.execute(f"PRAGMA {pragma}").fetchall()
            if writable:
                self._connection.executescript(schema)
        except sqlite3.DatabaseError as error:
            self.close()
            raise SessionError(f"{path}: cannot be used ({error})") from None

    @contextlib.contextmanager
    def transaction(self) -> Iterator[None]:
        """Makes the changes of a block in one step, or none of them if it fails; blocks may be nested.

        Raises:
            StorageError: no part of the block is stored.
        """
        if self._connection.in_transaction:
            yield
            return
        self.run("BEGIN IMMEDIATE")
        try:
            yield
            self.run("COMMIT")
        except BaseException:
            if self._connection.in_transaction:  # after some errors, SQLite has already rolled back
                self.run("ROLLBACK")
            raise

    @contextlib.contextmanager
    def snapshot(self) -> Iterator[None]:
        """Reads a consistent snapshot in a block; changes wait for its end, so it should be short."""
        self._connection.execute("BEGIN")
        try:
            yield
        finally:
            self._connection.execute("ROLLBACK")

    def run(self, statement: str, *values: object) -> None:
        """Runs a statement; raises `StorageError` if it fails."""
        self.rows(statement, *values)

    def rows(self, query: str, *values: object) -> list[sqlite3.Row]:
        """Returns the rows of a query; raises `StorageError` if it fails."""
        try:
            return self._connection.execute(query, values).fetchall()
        except sqlite3.OperationalError as error:
            raise StorageError(
                f"{self.path}: cannot be read or written now ({error}); check the space on the disk and its state"
            ) from error

    def row(self, query: str, *values: object) -> sqlite3.Row | None:
        """Returns the first row of a query; None if there is none."""
        found = self.rows(query, *values)
        return found[0] if found else None

    def value(self, query: str, *values: object) -> Any:
        """Returns the first column of the first row; None if there is none."""
        found = self.row(query, *values)
        return None if found is None else found[0]

    def compact(self) -> None:
        """Rewrites the file without the remains of deleted rows; raises `StorageError` if that fails."""
        self.run("VACUUM")

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()


class RunLock:
    """Lock of a study folder: one server, or one command that deletes, at a time; the death of the process ends it.

    Args:
        folder: the folder.

    Raises:
        SessionError: another process has it.
    """

    def __init__(self, folder: Path) -> None:
        self._connection = sqlite3.connect(folder / LOCK_FILE, timeout=0.0, isolation_level=None)
        try:
            self._connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError:
            self.close()
            raise SessionError(
                f"{folder}: its server is running; stop it first (people can go on afterwards)"
            ) from None

    def close(self) -> None:
        """Releases the lock."""
        self._connection.close()
