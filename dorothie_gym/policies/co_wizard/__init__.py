"""Scripted Co-Wizard: understands instructions, plans on its beliefs, asks when information is missing, and drives."""

from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.policy import PendingDecision, ScriptedCoWizard, attend, respond
from dorothie_gym.policies.co_wizard.state import CoWizardState

__all__ = ["CoWizardState", "CoWizardStyle", "PendingDecision", "ScriptedCoWizard", "attend", "respond"]
