"""Scripted Co-Wizard: understands instructions, plans with its beliefs, asks for missing information, and drives."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
