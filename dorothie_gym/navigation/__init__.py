"""The Co-Wizard's driving alone, for reinforcement learning: a participant who tells the way, small spaces, rewards."""

from dorothie_gym.navigation.actions import NavigationAction
from dorothie_gym.navigation.config import REWARDS, TRAFFIC, Guidance, NavigationConfig, NavigationWeights
from dorothie_gym.navigation.navigation_continuous_v0 import NavigationContinuousEnv
from dorothie_gym.navigation.navigation_v0 import NavigationEnv
from dorothie_gym.navigation.observations import FIELDS, layout
from dorothie_gym.navigation.pedals import PEDAL_FIELDS
from dorothie_gym.navigation.player import NavigationPlayer

__all__ = [
    "FIELDS",
    "PEDAL_FIELDS",
    "REWARDS",
    "TRAFFIC",
    "Guidance",
    "NavigationAction",
    "NavigationConfig",
    "NavigationContinuousEnv",
    "NavigationEnv",
    "NavigationPlayer",
    "NavigationWeights",
    "layout",
]
