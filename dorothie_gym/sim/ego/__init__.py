"""The car: path, local planner, controller, hazard stop."""
