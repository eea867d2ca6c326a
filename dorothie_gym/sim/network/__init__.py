"""The town's lanes as highway-env roads: lanes, network, the index for the closest lane, and the road on it."""
