"""Scripted participant: knows the tasks and all places, and gets the tasks done by dialogue."""

from dorothie_gym.policies.participant.policy import ScriptedParticipant

__all__ = ["ScriptedParticipant"]
