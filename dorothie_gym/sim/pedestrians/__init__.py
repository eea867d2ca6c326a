"""Pedestrians on pavements, crosswalks and streets without pavements."""
