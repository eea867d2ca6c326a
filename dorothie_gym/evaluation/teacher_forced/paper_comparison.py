"""Results and findings of the paper, and comparisons of models by paired differences over seeds."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

from dorothie_gym.evaluation.analysis.intervals import Estimate
from dorothie_gym.evaluation.teacher_forced.labels import SEEN, UNSEEN
from dorothie_gym.evaluation.teacher_forced.metrics import COLUMNS

FULL: Final = "TOTO"
NO_HISTORY: Final = "TOTO (- Action History)"
NO_UTTERANCE: Final = "TOTO (- Current Utterance)"
NO_MAP: Final = "TOTO (- Map Knowledge)"
TUNED: Final = "Text Only (Trained Encoder)"
OTHER_ABLATIONS: Final = ("TOTO (- GT Transcript)", "TOTO (- Objects)", "TOTO (- Object History)", NO_UTTERANCE, NO_MAP)
"""The other ablations of TOTO."""

COUNTERPARTS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "TOTO (+ Trained Text Encoder)": "TOTO (+ Fine-tuned BERT)",
        "TOTO (- Objects)": "TOTO (- Object Detection)",
        "TOTO (- Object History)": "TOTO (- Vision History)",
        "Text Only (Trained Encoder)": "Fine-tuned BERT Only",
        "Text Only": "BERT Only",
        "Objects Only": "Deformable-DETR Only",
        "TOTO (Episodic Inputs)": "E.T.",
        "TOTO (Episodic Inputs, Trained Text Encoder)": "E.T. (+ Fine-tuned BERT)",
    }
)
"""Rows of the paper by the models of this package that are compared with them under names of their own.

The paper's rows have a BERT, a Deformable DETR on pictures, and another architecture (E.T.). The package's models have
frozen vectors or an encoder that is trained from random weights, the objects of the world's record, and TOTO's
architecture.
"""

MOVE_METRICS: Final = ("ufn_move_accuracy", "rfn_move_accuracy")
ACTION_METRICS: Final = ("nfd_action_accuracy", "nfd_joint_accuracy")

SMALLEST_DIFFERENCE: Final = 0.05
"""Smallest difference that matters; about the largest width of the intervals in the paper (share)."""

Estimates: TypeAlias = Callable[[str, str, str], Estimate]
"""Returns the estimate of a model, a part of the corpus and a metric."""


class ModelVerdict(StrEnum):
    """Outcome of a claim."""

    HOLDS = "holds"
    UNDECIDED = "undecided"
    FAILS = "does not hold"
    UNTESTED = "not tested"


@dataclass(frozen=True, kw_only=True)
class ModelClaim:
    """Claim about the difference of two models in one metric.

    Attributes:
        metric: key of the metric.
        higher, lower: names of the models.
        difference: first model minus second, paired over seeds.
        expected: "positive", or "hardly any" for a difference below `SMALLEST_DIFFERENCE`.
    """

    metric: str
    higher: str
    lower: str
    difference: Estimate
    expected: Literal["positive", "hardly any"]

    @property
    def verdict(self) -> ModelVerdict:
        """Outcome by the 95 % interval of the difference.

        "positive" holds if the interval lies above 0, and fails if it lies below. "hardly any" holds if the interval
        lies below `SMALLEST_DIFFERENCE`, and fails if it lies above 0. Otherwise, or with fewer than two seeds, it is
        undecided.
        """
        mean, half = self.difference.mean, self.difference.half_width
        if mean is None:
            return ModelVerdict.UNTESTED
        if half is None:
            return ModelVerdict.UNDECIDED
        low, high = mean - half, mean + half
        if self.expected == "positive":
            holds, fails = low > 0.0, high < 0.0
        else:
            holds, fails = high < SMALLEST_DIFFERENCE, low > 0.0
        return ModelVerdict.HOLDS if holds else ModelVerdict.FAILS if fails else ModelVerdict.UNDECIDED

    def to_json(self) -> dict[str, object]:
        """Returns the fields and the verdict."""
        return {
            "metric": self.metric,
            "higher": self.higher,
            "lower": self.lower,
            "difference": self.difference.to_json(),
            "expected": self.expected,
            "verdict": self.verdict.value,
        }


@dataclass(frozen=True, kw_only=True)
class ModelFinding:
    """Finding on one part of the corpus: one of the paper, or that one model is better than another.

    Attributes:
        statement: the finding in words.
        part: part of the corpus.
        claims: claims that it consists of.
        note: remark on its interpretation.
    """

    statement: str
    part: str
    claims: tuple[ModelClaim, ...]
    note: str = ""

    @property
    def verdict(self) -> ModelVerdict:
        """Worst outcome of the claims: the finding fails if one fails, and holds if all hold."""
        found = {claim.verdict for claim in self.claims}
        order = (ModelVerdict.UNTESTED, ModelVerdict.FAILS, ModelVerdict.UNDECIDED)
        return next((verdict for verdict in order if verdict in found), ModelVerdict.HOLDS)

    def to_json(self) -> dict[str, object]:
        """Returns the fields and the verdict."""
        return {
            "statement": self.statement,
            "part": self.part,
            "verdict": self.verdict.value,
            "claims": [claim.to_json() for claim in self.claims],
            "note": self.note,
        }


def findings(
    estimate: Estimates, part: str, called: Callable[[str], str] = lambda model: model
) -> tuple[ModelFinding, ...]:
    """Returns the paper's findings on one part of the corpus (section 6, ablation on input modalities).

    Args:
        estimate: estimate of a model, a part and a metric over seeds; without seeds if the model was not run.
        part: part of the corpus.
        called: returns the name under which a model, or another that is compared with the same row, was run.
    """

    def claim(metric: str, higher: str, lower: str, *, positive: bool = True) -> ModelClaim:
        models = called(higher), called(lower)
        return _claim(estimate, part, metric, models, "positive" if positive else "hardly any")

    def most(metric: str) -> tuple[ModelClaim, ...]:
        rival = _lowest(estimate, part, metric, [called(model) for model in OTHER_ABLATIONS])
        return (claim(metric, FULL, NO_HISTORY), *([claim(metric, rival, NO_HISTORY)] if rival else []))

    return (
        ModelFinding(
            statement="Action history matters most: removing it lowers move and action accuracy more than removing "
            "any other input",
            part=part,
            claims=tuple(c for metric in (*MOVE_METRICS, *ACTION_METRICS) for c in most(metric)),
            note="In the published features, the history of a UfN point contains the point's own label, which is "
            "removed together with the history; here it is never included.",
        ),
        ModelFinding(
            statement="The current utterance matters for UfN",
            part=part,
            claims=(claim("ufn_move_accuracy", FULL, NO_UTTERANCE),),
            note="The paper removes the sound of the utterance and keeps its words; here both are removed.",
        ),
        ModelFinding(
            statement="Text alone leads on moves and trails on NfD joint, if its encoder is trained",
            part=part,
            claims=(*(claim(metric, TUNED, FULL) for metric in MOVE_METRICS), claim("nfd_joint_accuracy", FULL, TUNED)),
            note="The paper fine-tunes a BERT; the encoder of the package is trained from random weights, unless the "
            "published sizes find MiniLM.",
        ),
        ModelFinding(
            statement="Map knowledge hardly helps",
            part=part,
            claims=tuple(claim(metric, FULL, NO_MAP, positive=False) for metric in COLUMNS),
        ),
    )


def above(estimate: Estimates, part: str, higher: str, lower: str, metrics: Sequence[str] = COLUMNS) -> ModelFinding:
    """Returns the finding that one model is better than another in every given metric.

    Args:
        estimate: as in `findings`.
        part: part of the corpus.
        higher: name of the better model.
        lower: name of the other; both need the same seeds to be paired, even if a seed changes nothing.
        metrics: keys of the metrics.
    """
    claims = tuple(_claim(estimate, part, metric, (higher, lower), "positive") for metric in metrics)
    return ModelFinding(statement=f"{higher} is above {lower}", part=part, claims=claims)


def _claim(
    estimate: Estimates, part: str, metric: str, models: tuple[str, str], expected: Literal["positive", "hardly any"]
) -> ModelClaim:
    higher, lower = models
    difference = estimate(higher, part, metric).minus(estimate(lower, part, metric))
    return ModelClaim(metric=metric, higher=higher, lower=lower, difference=difference, expected=expected)


def _lowest(estimate: Estimates, part: str, metric: str, models: Sequence[str]) -> str | None:
    """Returns the model with the lowest mean of a metric; None if no model has the metric."""
    means = {model: estimate(model, part, metric).mean for model in models}
    known = {model: mean for model, mean in means.items() if mean is not None}
    return min(known, key=known.__getitem__) if known else None


# --- Results of the paper, shown beside those of this package --------------------------------------------------------

_FILE: Final = "data/paper_results.json"


@dataclass(frozen=True, kw_only=True)
class PaperFigure:
    """Result of the paper and half the width of its interval, as shares in [0, 1]."""

    mean: float
    half_width: float


@cache
def paper_figures() -> Mapping[str, Mapping[str, Mapping[str, PaperFigure]]]:
    """Returns the paper's figures: model -> "seen" or "unseen" -> key of a column of the table -> figure."""
    page = json.loads(files("dorothie_gym.evaluation.teacher_forced").joinpath(_FILE).read_text(encoding="utf-8"))
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
    page = json.loads(files("dorothie_gym.evaluation.teacher_forced").joinpath(_FILE).read_text(encoding="utf-8"))
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
    """Returns the paper's row with which a model is compared, by its name in any case; None if there is none.

    These are the rows themselves, and those of `COUNTERPARTS`.
    """
    rows = {name.casefold(): name for name in paper_figures()}
    rows |= {name.casefold(): row for name, row in COUNTERPARTS.items()}
    return rows.get(model.casefold())
