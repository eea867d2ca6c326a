"""Models of bodies in their own frame: x forward, y to the right, z up, origin on the ground below their centre."""
