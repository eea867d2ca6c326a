"""Self-play: Co-Wizard and participant against the Ad-Wizard, all learning at once (docs/selfplay.md).

`role_interface.RoleInterface` defines what a role's network observes and can do, `env.SelfPlaySessions` plays all three
roles of many sessions, `multi_agent_rollout.MultiAgentRollout` collects their experience, `training.SelfPlayTraining`
is a training in a folder, and `policy.LearnedPolicy` plays the result.
"""
