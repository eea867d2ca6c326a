"""Closed-loop play: benchmark models as Co-Wizards."""
