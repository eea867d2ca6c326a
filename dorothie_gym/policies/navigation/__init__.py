"""Driving as the Co-Wizard: observation vector, actions, instructions, and a policy that runs a trained driver."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
