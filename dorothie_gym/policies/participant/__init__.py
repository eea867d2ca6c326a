"""The scripted human: knows the tasks and all places, and gets them done by talk."""

from dorothie_gym.policies.participant.policy import ScriptedParticipant

__all__ = ["ScriptedParticipant"]
