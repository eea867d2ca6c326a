"""The scripted Co-Wizard: understands what it is told, plans on what it knows, asks when it does not, and drives."""

from dorothie_gym.policies.co_wizard.mind import CoWizardMind, Style
from dorothie_gym.policies.co_wizard.policy import Attention, ScriptedCoWizard, attend, respond

__all__ = ["Attention", "CoWizardMind", "ScriptedCoWizard", "Style", "attend", "respond"]
