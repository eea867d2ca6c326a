"""`UfN-v0`: understanding from navigation, teacher-forced over a corpus."""

from __future__ import annotations

from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv


class UfNEnv(TeacherForcedEnv):
    """Understanding from navigation (UfN): predict the dialogue act of a participant's utterance.

    ## Description
    An episode walks through the participant's utterances of one recorded session, see `TeacherForcedEnv`.

    ## Observation Space
    As of `TeacherForcedEnv`, with the words in `utterance`.

    ## Action Space
    `move` Discrete(15), `slots` MultiBinary(69).

    ## Rewards
    The mean of two terms: `move`, 1 if the move is right; `slots`, F1 over the (slot, value) pairs of the point, 1 if
    the point has no pair and none is predicted.

    ## Episode End
    As of `TeacherForcedEnv`.

    ## Arguments
    As of `TeacherForcedEnv`.

    ## Version History
    - v0: first version.
    """

    of_task = Task.UFN
