"""Driving by navigation actions: shared code of `Navigation-v0` and `Navigation-continuous-v0`, in batches."""
