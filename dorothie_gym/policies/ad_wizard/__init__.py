"""The scripted Ad-Wizard: changes the world and the task, a few times a session."""

from dorothie_gym.policies.ad_wizard.policy import KINDS, ScriptedAdWizard, Trick

__all__ = ["KINDS", "ScriptedAdWizard", "Trick"]
