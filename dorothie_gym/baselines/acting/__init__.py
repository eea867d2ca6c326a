"""Models of the benchmark as Co-Wizards: what they were trained to tell at recorded points, they do (closed loop)."""
