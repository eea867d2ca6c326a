"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .catalogue import SEEN_TOWNS as SEEN_TOWNS
from .catalogue import UNSEEN_TOWNS as UNSEEN_TOWNS
from .catalogue import describe as describe
from .catalogue import fold_of as fold_of
from .catalogue import load_town as load_town
from .catalogue import town_names as town_names
from .lint import check_town as check_town
from .lint.fault import Fault as Fault
from .model import NO_JUNCTION as NO_JUNCTION
from .model import NO_STREET as NO_STREET
from .model import Crosswalk as Crosswalk
from .model import Exit as Exit
from .model import Junction as Junction
from .model import Lane as Lane
from .model import LaneLink as LaneLink
from .model import LinkType as LinkType
from .model import Sidewalk as Sidewalk
from .model import Signal as Signal
from .model import SignalKind as SignalKind
from .model import Site as Site
from .model import Street as Street
from .town import LightColour as LightColour
from .town import LightPhase as LightPhase
from .town import LightProgramme as LightProgramme
from .town import Town as Town
