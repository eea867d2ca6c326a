"""The YAML town language: `schema` reads a plan, `layout` finds its centre lines, `compile` makes the town."""

from dorothie_gym.world.town.yaml_town.compile import read_yaml_town

__all__ = ["read_yaml_town"]
