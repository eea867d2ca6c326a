"""A session: its engine, exceptions, dialogue, beliefs, observations and actions of the roles, and its recording."""
