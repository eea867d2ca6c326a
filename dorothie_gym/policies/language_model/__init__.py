"""Policies of the three roles that ask a language model, by any endpoint with OpenAI's chat interface.

A policy turns the observation of its role into a prompt, asks for JSON under a schema made from the action space and
its mask, and turns the answer into actions (docs/language-models.md). The package httpx (extra `llm`) is imported when
the first policy is made.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
