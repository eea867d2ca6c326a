"""A session: its engine, exceptions, dialogue and beliefs, what the roles observe and do, and its recording."""
