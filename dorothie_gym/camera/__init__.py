"""First-person camera: the scene of a town as triangles, drawn on one processor core without graphics libraries."""
