"""Situated Dialogue Navigation corpus (SDN): reader into `Session`, and writer of its release layout."""

from dorothie_gym.recording.sdn.files import SdnLayout, detect_layout
from dorothie_gym.recording.sdn.reader import read_sdn, settle_sign
from dorothie_gym.recording.sdn.turn_angles import SignVote
from dorothie_gym.recording.sdn.writer import write_sdn

__all__ = ["SdnLayout", "SignVote", "detect_layout", "read_sdn", "settle_sign", "write_sdn"]
