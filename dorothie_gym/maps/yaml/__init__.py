"""YAML town language: `schema` reads a plan, `layout` computes its centre lines, `compile` builds the town."""

from dorothie_gym.maps.yaml.compile import read_yaml_town

__all__ = ["read_yaml_town"]
