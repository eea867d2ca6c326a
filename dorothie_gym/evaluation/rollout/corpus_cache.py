"""Default corpus: a small corpus that is generated once and kept in the user's cache."""

from __future__ import annotations

import hashlib
import json
import logging
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from dorothie_gym._version import __version__
from dorothie_gym.errors import CacheError
from dorothie_gym.evaluation.rollout.corpus_generation import generate_corpus, named_towns
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.header import FORMAT_VERSION
from dorothie_gym.support.user_cache import (
    CACHE_VARIABLE,
    cache_folder,
    is_private,
    is_sealed,
    remove,
    report_damage,
    seal,
)

SESSIONS = 20
"""Number of sessions: each fold has at least one, and the generation takes some minutes."""

SEED = 0

CONFIG = EnvConfig()

_LOG = logging.getLogger(__name__)


def default_corpus(*, sessions: int | None = None, seed: int = SEED, config: EnvConfig | None = None) -> Path:
    """Returns the folder of a corpus of the scripted roles; generates it at the first call, with a progress bar.

    Folds and towns have the proportions of the paper. The corpus is kept in the user's cache; the name of its folder
    contains the version of the package and a hash of the settings. The folder appears when all sessions are played, so
    that incomplete corpora are never read. One with a damaged file is renamed to `NAME.damaged` and generated again.

    Args:
        sessions: number of sessions; `SESSIONS` if None.
        seed: seed of the corpus.
        config: settings of the engine; `CONFIG` if None.

    Raises:
        CacheError: the cache cannot be written.
        ValueError: no sessions, or a negative seed.
    """
    config = CONFIG if config is None else config
    sessions = SESSIONS if sessions is None else sessions
    key = {
        "sealed": True,
        "format": FORMAT_VERSION,
        "sessions": sessions,
        "seed": seed,
        "config": config.record(),
        **named_towns(),
    }
    digest = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:12]
    cache = cache_folder()
    if cache is None:
        raise CacheError(
            f"sessions cannot be kept: {CACHE_VARIABLE} is empty or names a folder that others can write; set it to a "
            "folder that only you can write"
        )
    folder = cache / f"corpus-{__version__}-{digest}"
    if not is_private(folder):
        raise CacheError(f"{folder}: belongs to another user or can be written by others; remove it")
    if is_sealed(folder, cache):
        return folder
    with _naming_the_variable(folder.parent):
        folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.exists():
            _set_aside(folder)
        part = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", suffix=".part", dir=folder.parent))
        try:
            _play(part, sessions, seed, config)
            seal(part, folder.name, cache)
            _publish(part, folder)
        finally:
            shutil.rmtree(part, ignore_errors=True)
    return folder


def _set_aside(folder: Path) -> None:
    """Renames a damaged corpus, because people may have annotated its sessions."""
    aside = folder.with_name(f"{folder.name}.damaged")
    remove(aside)
    folder.rename(aside)
    report_damage(folder, f"it does not fit its seal; now {aside.name}")


def _play(folder: Path, sessions: int, seed: int, config: EnvConfig) -> None:
    console = Console(stderr=True)
    _LOG.info("playing %d sessions, which are stored in %s", sessions, folder.parent)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("Generating the default corpus", total=sessions)

        def advance(done: int, _: int) -> None:
            progress.update(bar, completed=done)

        # one process, because several need an importable main module
        generate_corpus(folder, sessions=sessions, seed=seed, config=config, on_session=advance)


def _publish(part: Path, folder: Path) -> None:
    """Renames the finished folder, unless another process has already stored the same sessions."""
    try:
        part.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise


@contextmanager
def _naming_the_variable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise CacheError(
            f"{folder}: no corpus can be stored here ({error.strerror or error}); "
            f"set {CACHE_VARIABLE} to a folder that can be written, or give a folder of sessions"
        ) from error
