"""Results of the paper, shown beside those of this package."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final

from dorothie_gym.benchmark.labels import SEEN, UNSEEN
from dorothie_gym.benchmark.metrics import COLUMNS

_FILE: Final = "data/paper_results.json"


@dataclass(frozen=True, kw_only=True)
class PaperFigure:
    """Result of the paper and half the width of its interval, as shares in [0, 1]."""

    mean: float
    half_width: float


@cache
def paper_figures() -> Mapping[str, Mapping[str, Mapping[str, PaperFigure]]]:
    """Returns the paper's figures: model -> "seen" or "unseen" -> key of a column of the table -> figure."""
    page = json.loads(files("dorothie_gym.benchmark").joinpath(_FILE).read_text(encoding="utf-8"))
    assert page["columns"] == list(COLUMNS)
    return {
        model: {
            part: {
                key: PaperFigure(mean=mean / 100.0, half_width=half / 100.0)
                for key, (mean, half) in zip(page["columns"], folds[part], strict=True)
            }
            for part in (SEEN, UNSEEN)
        }
        for model, folds in page["models"].items()
    }


def paper_source() -> str:
    """Returns the source of the results of the paper."""
    page = json.loads(files("dorothie_gym.benchmark").joinpath(_FILE).read_text(encoding="utf-8"))
    return str(page["source"])


def paper_figure(model: str, part: str, key: str) -> PaperFigure | None:
    """Returns the result of the paper for a model, or None.

    Args:
        model: name of the model, in any case.
        part: part of the corpus.
        key: one of our metrics, `ufn_slot_f1_paper` or `ufn_slot_f1`.
    """
    return paper_figures().get(paper_name(model) or "", {}).get(part, {}).get(key.removesuffix("_paper"))


def paper_name(model: str) -> str | None:
    """Returns the spelling of a model's name in the paper, ignoring case; None if the paper has no such model."""
    names = {name.casefold(): name for name in paper_figures()}
    return names.get(model.casefold())
