"""What a corpus is like: counts, profiles, phenomena, consistency and agreement, all found anew from the events."""

from dorothie_gym.sessions.statistics.agreement import Agreement, agreement
from dorothie_gym.sessions.statistics.anchors import Anchors, anchors_of
from dorothie_gym.sessions.statistics.census import Census, census_of, faults_of_corpus, phenomena_of
from dorothie_gym.sessions.statistics.consistency import inconsistencies
from dorothie_gym.sessions.statistics.counts import PAPER, PAPER_FOLDS, Counts
from dorothie_gym.sessions.statistics.handling import Handled, handled_by, handling, handling_of_events
from dorothie_gym.sessions.statistics.phenomena import PHENOMENA, Finding, Phenomenon, Talk
from dorothie_gym.sessions.statistics.profiles import Profile, Profiles
from dorothie_gym.sessions.statistics.units import SaidUnit, Units

__all__ = [
    "PAPER",
    "PAPER_FOLDS",
    "PHENOMENA",
    "Agreement",
    "Anchors",
    "Census",
    "Counts",
    "Finding",
    "Handled",
    "Phenomenon",
    "Profile",
    "Profiles",
    "SaidUnit",
    "Talk",
    "Units",
    "agreement",
    "anchors_of",
    "census_of",
    "faults_of_corpus",
    "handled_by",
    "handling",
    "handling_of_events",
    "inconsistencies",
    "phenomena_of",
]
