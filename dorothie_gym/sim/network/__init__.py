"""Lanes of a town as a road network of highway-env, with indexes for the closest lane."""
