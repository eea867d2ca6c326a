"""Town maps: the data model, the catalogue of shipped towns, and readers for OpenDRIVE and YAML files."""

from dorothie_gym.errors import TownError
from dorothie_gym.maps.catalogue import SEEN_TOWNS, UNSEEN_TOWNS, describe, fold_of, load_town, town_names
from dorothie_gym.maps.model import (
    NO_JUNCTION,
    NO_STREET,
    Crosswalk,
    Exit,
    Junction,
    Lane,
    LaneLink,
    LinkType,
    Sidewalk,
    Signal,
    SignalKind,
    Site,
    Street,
)
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.traffic_lights import LightColour, LightPhase, LightProgramme

__all__ = [
    "NO_JUNCTION",
    "NO_STREET",
    "SEEN_TOWNS",
    "UNSEEN_TOWNS",
    "Crosswalk",
    "Exit",
    "Junction",
    "Lane",
    "LaneLink",
    "LightColour",
    "LightPhase",
    "LightProgramme",
    "LinkType",
    "Sidewalk",
    "Signal",
    "SignalKind",
    "Site",
    "Street",
    "Town",
    "TownError",
    "describe",
    "fold_of",
    "load_town",
    "town_names",
]
