"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .batch import HISTORY as HISTORY
from .batch import Batch as Batch
from .batch import BatchSpec as BatchSpec
from .batch import HistorySizes as HistorySizes
from .batch import gather as gather
from .columns import CO_WIZARD as CO_WIZARD
from .columns import NO_TEXT as NO_TEXT
from .columns import PARTICIPANT as PARTICIPANT
from .columns import ActionRows as ActionRows
from .columns import Columns as Columns
from .columns import FrameRows as FrameRows
from .columns import GoalRows as GoalRows
from .columns import LandmarkRows as LandmarkRows
from .columns import LookRows as LookRows
from .columns import MoveRows as MoveRows
from .columns import ObjectRows as ObjectRows
from .columns import SessionRows as SessionRows
from .columns import StreetRows as StreetRows
from .columns import TownGraph as TownGraph
from .columns import UtteranceRows as UtteranceRows
from .corpus_columns import build as build
from .corpus_columns import columns_of as columns_of
from .point_table import PointTable as PointTable
from .point_table import points as points
from .sight import Sight as Sight
from .sight import VisibleBoxes as VisibleBoxes
