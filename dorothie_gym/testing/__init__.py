"""Contracts of the package as reusable checks, for people who write a policy, a town, an environment or a recorder.

Each check raises `AssertionError` with a message that names the broken rule and where it broke, so that one call is a
test:

```python
from dorothie_gym.testing import check_policy

def test_my_policy() -> None:
    check_policy(MyCoWizard())
```
"""

from dorothie_gym.testing.checks import check_policy, check_session, check_town
from dorothie_gym.testing.leaks import check_observations_do_not_leak

__all__ = ["check_observations_do_not_leak", "check_policy", "check_session", "check_town"]
