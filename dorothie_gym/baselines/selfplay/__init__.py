"""Self-play: Co-Wizard and participant against the Ad-Wizard, each learning at once; see docs/selfplay.md.

A seat (`seat.Seat`) is what a role's network takes in and can do; `env.SelfPlayEnv` has all three in one row;
`game.Game` lets learners play; `training.SelfPlay` is a run in a folder; `policy.LearnedPolicy` plays what was learned.
"""
