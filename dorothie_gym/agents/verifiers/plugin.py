"""Module `dorothie_sessions` of an installed package: verifiers finds tasksets and harnesses by top-level modules."""

from dorothie_gym.agents.verifiers.sessions import DorothieHarness, DorothieTaskset

__all__ = ["DorothieHarness", "DorothieTaskset"]
