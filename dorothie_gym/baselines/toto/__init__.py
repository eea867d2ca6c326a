"""TOTO and what it is made of."""

from dorothie_gym.baselines.toto.config import ABLATIONS, ALL_CHANNELS, Channel, LossWeights, TOTOConfig
from dorothie_gym.baselines.toto.losses import point_losses
from dorothie_gym.baselines.toto.model import TOTO
from dorothie_gym.baselines.toto.texts import FrozenTexts, PretrainedBert, SmallTextEncoder, Texts, TrainedTexts
from dorothie_gym.baselines.toto.towns import Towns

__all__ = [
    "ABLATIONS",
    "ALL_CHANNELS",
    "TOTO",
    "Channel",
    "FrozenTexts",
    "LossWeights",
    "PretrainedBert",
    "SmallTextEncoder",
    "TOTOConfig",
    "Texts",
    "Towns",
    "TrainedTexts",
    "point_losses",
]
