"""One session in progress: the session engine, observations, masks, exceptions, dialogue channel and beliefs."""
