"""Scenery of a town: buildings, trees, lamps, lights, signs and landmarks, where the map leaves room for them."""
