"""The ego car: controller, local planner, path, motion control, hazards."""
