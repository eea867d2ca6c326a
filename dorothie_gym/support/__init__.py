"""Files, caches, compiled functions and arithmetic that all packages share."""
