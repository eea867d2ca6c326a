"""Corpus analysis: counts, profiles, phenomena, consistency and agreement, all derived from the events."""

from dorothie_gym.analysis.agreement import agreement, inconsistencies
from dorothie_gym.analysis.behaviour import CLAIMS, BehaviourClaim, BehaviourVerdict, verdicts_of
from dorothie_gym.analysis.corpus_stats import (
    PAPER,
    Anchors,
    CorpusStats,
    Counts,
    anchors_of,
    corpus_stats_of,
    faults_of_corpus,
    phenomena_of,
)
from dorothie_gym.analysis.exception_attribution import Handled, handled_by, handling, handling_of_events
from dorothie_gym.analysis.phenomena import PHENOMENA, DialogueView, Occurrence, Phenomenon
from dorothie_gym.analysis.profiles import Profile, Profiles
from dorothie_gym.analysis.segmentation_agreement import (
    SegmentationAgreement,
    SegmentedSession,
    UnitSpan,
    segmentation_agreement,
    segmentation_alpha,
)
from dorothie_gym.analysis.span_agreement import Agreement, Alpha, LabelledSpan, agreement_of, alpha_of, has_alpha
from dorothie_gym.analysis.units import SaidUnit, Units

__all__ = [
    "CLAIMS",
    "PAPER",
    "PHENOMENA",
    "Agreement",
    "Alpha",
    "Anchors",
    "BehaviourClaim",
    "BehaviourVerdict",
    "CorpusStats",
    "Counts",
    "DialogueView",
    "Handled",
    "LabelledSpan",
    "Occurrence",
    "Phenomenon",
    "Profile",
    "Profiles",
    "SaidUnit",
    "SegmentationAgreement",
    "SegmentedSession",
    "UnitSpan",
    "Units",
    "agreement",
    "agreement_of",
    "alpha_of",
    "anchors_of",
    "corpus_stats_of",
    "faults_of_corpus",
    "handled_by",
    "handling",
    "handling_of_events",
    "has_alpha",
    "inconsistencies",
    "phenomena_of",
    "segmentation_agreement",
    "segmentation_alpha",
    "verdicts_of",
]
