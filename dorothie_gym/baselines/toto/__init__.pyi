"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .config import ABLATIONS as ABLATIONS
from .config import ALL_CHANNELS as ALL_CHANNELS
from .config import Channel as Channel
from .config import LossWeights as LossWeights
from .config import TOTOConfig as TOTOConfig
from .losses import point_losses as point_losses
from .model import TOTO as TOTO
from .texts import FrozenTexts as FrozenTexts
from .texts import PretrainedBert as PretrainedBert
from .texts import SmallTextEncoder as SmallTextEncoder
from .texts import Texts as Texts
from .texts import TrainedTexts as TrainedTexts
from .towns import Towns as Towns
