"""Adapter to verifiers 0.4 (extra `verifiers`): taskset and harness `dorothie-sessions` (docs/agents-verifiers.md)."""
