"""Driving as the Co-Wizard: observation vector, actions, instructions, and a policy that runs a trained driver."""

from dorothie_gym.policies.navigation.actions import NavigationAction
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.navigation_policy import NavigationPolicy
from dorothie_gym.policies.navigation.observation_vector import FIELD_SPECS, FIELDS, layout

__all__ = ["FIELDS", "FIELD_SPECS", "Guidance", "NavigationAction", "NavigationPolicy", "layout"]
