"""Which of the paper's findings appear in a table, and what beats what: claims about paired differences over seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Literal, TypeAlias

from dorothie_gym.analysis.intervals import Estimate
from dorothie_gym.benchmark.metrics import COLUMNS

FULL: Final = "TOTO"
NO_HISTORY: Final = "TOTO (- Action History)"
NO_SPEECH: Final = "TOTO (- Current Speech)"
NO_MAP: Final = "TOTO (- Map Knowledge)"
TUNED: Final = "Fine-tuned BERT Only"
OTHER_ABLATIONS: Final = (
    "TOTO (- GT Transcript)", "TOTO (- Object Detection)", "TOTO (- Vision History)", NO_SPEECH, NO_MAP,
)  # fmt: skip
"""What else is taken away from TOTO, one at a time."""

MOVES: Final = ("ufn_move_accuracy", "rfn_move_accuracy")
ACTIONS: Final = ("nfd_action_accuracy", "nfd_joint_accuracy")

MARGIN: Final = 0.05
"""Less than this is hardly anything: the paper's own intervals are up to about so wide (share)."""

Estimates: TypeAlias = Callable[[str, str, str], Estimate]
"""Figure of a model, a part of the corpus and a metric."""


class ModelVerdict(StrEnum):
    """How a claim comes out."""

    HOLDS = "holds"
    UNDECIDED = "undecided"
    FAILS = "does not hold"
    UNTESTED = "not tested"


@dataclass(frozen=True, kw_only=True)
class ModelClaim:
    """A difference between two models in one figure, and what the paper has it be.

    Attributes:
        metric: key of the metric.
        higher, lower: the models; the difference is the first minus the second, seed by seed.
        difference: the difference.
        expected: "positive", or "hardly any" where next to nothing should be gained.
    """

    metric: str
    higher: str
    lower: str
    difference: Estimate
    expected: Literal["positive", "hardly any"]

    @property
    def verdict(self) -> ModelVerdict:
        """Whether the 95 % interval of the difference lies where it is expected.

        "positive" holds if all of it is above 0, and fails if all is below. "hardly any" holds if all of it is below
        `MARGIN`, and fails if all is above 0. Else it is undecided, as it is with less than two seeds.
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
            holds, fails = high < MARGIN, low > 0.0
        return ModelVerdict.HOLDS if holds else ModelVerdict.FAILS if fails else ModelVerdict.UNDECIDED

    def to_json(self) -> dict[str, Any]:
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
    """A finding on one part of the corpus: the paper's, or that one model is above another.

    Attributes:
        statement: the finding.
        part: part of the corpus.
        claims: what it says of figures.
        note: what has to be kept in mind with it.
    """

    statement: str
    part: str
    claims: tuple[ModelClaim, ...]
    note: str = ""

    @property
    def verdict(self) -> ModelVerdict:
        """The worst of its claims: it fails where one fails, and holds where all hold."""
        found = {claim.verdict for claim in self.claims}
        order = (ModelVerdict.UNTESTED, ModelVerdict.FAILS, ModelVerdict.UNDECIDED)
        return next((verdict for verdict in order if verdict in found), ModelVerdict.HOLDS)

    def to_json(self) -> dict[str, Any]:
        """Returns the fields and the verdict."""
        return {
            "statement": self.statement,
            "part": self.part,
            "verdict": self.verdict.value,
            "claims": [claim.to_json() for claim in self.claims],
            "note": self.note,
        }


def findings(estimate: Estimates, part: str) -> tuple[ModelFinding, ...]:
    """Returns the paper's findings on one part of the corpus (section 6, ablation on input modalities).

    Args:
        estimate: figure of a model, a part and a metric over seeds; without any seed where there is none.
        part: part of the corpus.
    """

    def claim(metric: str, higher: str, lower: str, *, positive: bool = True) -> ModelClaim:
        return _claim(estimate, part, metric, (higher, lower), "positive" if positive else "hardly any")

    def most(metric: str) -> tuple[ModelClaim, ...]:
        rival = _lowest(estimate, part, metric, OTHER_ABLATIONS)
        return (claim(metric, FULL, NO_HISTORY), *([claim(metric, rival, NO_HISTORY)] if rival else []))

    return (
        ModelFinding(
            statement="Action history matters most: removing it lowers move and action accuracy more than removing "
            "any other input",
            part=part,
            claims=tuple(c for metric in (*MOVES, *ACTIONS) for c in most(metric)),
            note="In the published features, the history of a UfN point contains the point's own label, which is "
            "removed together with the history; here it is never included.",
        ),
        ModelFinding(
            statement="The current utterance matters for UfN",
            part=part,
            claims=(claim("ufn_move_accuracy", FULL, NO_SPEECH),),
        ),
        ModelFinding(
            statement="Fine-tuned BERT leads on moves and trails on NfD joint",
            part=part,
            claims=(*(claim(metric, TUNED, FULL) for metric in MOVES), claim("nfd_joint_accuracy", FULL, TUNED)),
        ),
        ModelFinding(
            statement="Map knowledge hardly helps",
            part=part,
            claims=tuple(claim(metric, FULL, NO_MAP, positive=False) for metric in COLUMNS),
        ),
    )


def above(estimate: Estimates, part: str, higher: str, lower: str, metrics: Sequence[str] = COLUMNS) -> ModelFinding:
    """Returns whether one model is above another in every one of some figures.

    Args:
        estimate: as in `findings`.
        part: part of the corpus.
        higher: the one.
        lower: the other; to be paired they need the same seeds, also where a seed changes nothing.
        metrics: keys of the figures.
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
    """The model with the lowest mean of a figure, None where none has it."""
    means = {model: estimate(model, part, metric).mean for model in models}
    known = {model: mean for model, mean in means.items() if mean is not None}
    return min(known, key=known.__getitem__) if known else None
