"""Driving by navigation actions: what the two ids `Navigation-v0` and `Navigation-continuous-v0` share, in batches."""
