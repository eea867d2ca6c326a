"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .ad_wizard import ScriptedAdWizard as ScriptedAdWizard
from .ad_wizard import Trick as Trick
from .co_wizard.policy import ScriptedCoWizard as ScriptedCoWizard
from .participant.policy import ScriptedParticipant as ScriptedParticipant
from .policy import DESCRIPTION as DESCRIPTION
from .policy import Policy as Policy
from .policy_loader import ALL_SCRIPTED as ALL_SCRIPTED
from .policy_loader import LANGUAGE_MODEL as LANGUAGE_MODEL
from .policy_loader import POLICY_NAMES as POLICY_NAMES
from .policy_loader import AnyPlayer as AnyPlayer
from .policy_loader import Loader as Loader
from .policy_loader import Player as Player
from .policy_loader import find_player as find_player
from .policy_loader import loadable_kinds as loadable_kinds
from .policy_loader import make_policy as make_policy
from .policy_loader import player_of as player_of
from .policy_loader import policy_names as policy_names
from .policy_loader import register_loader as register_loader
from .pretrained import PretrainedCard as PretrainedCard
from .pretrained import pretrained_card as pretrained_card
from .pretrained import pretrained_folder as pretrained_folder
from .pretrained import pretrained_names as pretrained_names
from .pretrained import pretrained_size as pretrained_size
from .trivial import LaneFollowPolicy as LaneFollowPolicy
from .trivial import RandomPolicy as RandomPolicy
from .trivial import SilentPolicy as SilentPolicy
