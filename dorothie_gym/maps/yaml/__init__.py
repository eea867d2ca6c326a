"""The YAML town language: `schema` reads a plan, `layout` finds its centre lines, `compile` makes the town."""

from dorothie_gym.maps.yaml.compile import read_yaml_town

__all__ = ["read_yaml_town"]
