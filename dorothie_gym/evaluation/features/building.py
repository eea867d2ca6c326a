"""A corpus becomes columns."""

from __future__ import annotations

from pathlib import Path

from dorothie_gym.evaluation.features.columns import Columns
from dorothie_gym.sessions import Corpus


def build(corpus: Corpus | Path | str, *, cache: bool = True) -> Columns:
    """Returns a corpus as columns: as it was kept when it was built before, else built and kept for the next time.

    Args:
        corpus: a corpus or its folder.
        cache: whether to look for it, and keep it, in the user's cache folder (`DOROTHIE_GYM_CACHE`).

    Raises:
        SessionError: there is no session, or none can be read.
    """
    raise NotImplementedError
