"""Contracts of the package as reusable checks, for people who write a policy, a town, an environment or a recorder.

Each check raises `AssertionError` with a message that names the broken rule and the place, so that one call is a test:

```python
from dorothie_gym.testing import check_policy

def test_my_policy() -> None:
    check_policy(MyCoWizard())
```
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
