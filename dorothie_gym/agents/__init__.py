"""Sessions for language-model agents: one role is played by text, turn by turn, and the others by policies.

`TextSession` hands out pages and takes answers. It needs no language model, no network and no further package. The
subpackages are adapters to frameworks for agents, each with an extra of its own (docs/agents.md).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
