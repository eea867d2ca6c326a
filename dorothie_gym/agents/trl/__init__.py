"""Adapter to TRL 1.16 (extra `trl`): environment for `GRPOTrainer`, and rows of its dataset (docs/agents-trl.md)."""
