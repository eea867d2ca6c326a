"""Ground of the camera: materials under every point, and a mesh of the surface with kerbs, bridges and tunnels."""
