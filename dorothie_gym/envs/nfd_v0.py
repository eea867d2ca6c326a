"""`NfD-v0`: navigation from dialogue, teacher-forced over a corpus."""

from __future__ import annotations

from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv


class NfDEnv(TeacherForcedEnv):
    """Navigation from dialogue (NfD): predict the next physical action of the Co-Wizard.

    ## Description
    An episode walks through the navigation actions of one recorded session, see `TeacherForcedEnv`.

    ## Observation Space
    As of `TeacherForcedEnv`; there is no `utterance`.

    ## Action Space
    `action` Discrete(6), a class of `PhysicalAction.nfd_class`; `angle` Discrete(360, start=-180), the argument of the
    action [degrees, positive left], 0 for actions without one.

    ## Rewards
    The mean of two terms: `action`, 1 if the action is right; `joint`, 1 if also the angle is within 15 degrees on the
    circle. Where the recording has no angle, `joint` is NaN, and the reward is `action`.

    ## Episode End
    As of `TeacherForcedEnv`.

    ## Arguments
    As of `TeacherForcedEnv`.

    ## Version History
    - v0: first version.
    """

    of_task = Task.NFD
