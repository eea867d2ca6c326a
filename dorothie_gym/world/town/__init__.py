"""Towns to drive in: the model, towns that are shipped or read from files, and a town in figures."""

from dorothie_gym.world.town.catalogue import SEEN_TOWNS, UNSEEN_TOWNS, fold_of, load_town, town_names
from dorothie_gym.world.town.describe import describe
from dorothie_gym.world.town.errors import TownError
from dorothie_gym.world.town.lights import LightColour, LightPhase, LightProgramme
from dorothie_gym.world.town.model import (
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
    Town,
)

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
