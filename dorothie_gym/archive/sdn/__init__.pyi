"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .files import SdnLayout as SdnLayout
from .files import detect_layout as detect_layout
from .reader import read_sdn as read_sdn
from .reader import settle_sign as settle_sign
from .turn_angles import SignVote as SignVote
from .writer import write_sdn as write_sdn
