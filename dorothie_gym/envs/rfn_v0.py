"""`RfN-v0`: response from navigation, teacher-forced over a corpus."""

from __future__ import annotations

from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv


class RfNEnv(TeacherForcedEnv):
    """Response from navigation (RfN): predict the next dialogue act of the Co-Wizard.

    ## Description
    An episode walks through the Co-Wizard's utterances of one recorded session, see `TeacherForcedEnv`.

    ## Observation Space
    As of `TeacherForcedEnv`; there is no `utterance`.

    ## Action Space
    `move` Discrete(15), `slots` MultiBinary(69).

    ## Rewards
    As of `UfNEnv`.

    ## Episode End
    As of `TeacherForcedEnv`.

    ## Arguments
    As of `TeacherForcedEnv`.

    ## Version History
    - v0: first version.
    """

    of_task = Task.RFN
