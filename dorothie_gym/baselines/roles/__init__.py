"""Roles of the session whose decisions are learned by imitation: the Co-Wizard and the participant."""
