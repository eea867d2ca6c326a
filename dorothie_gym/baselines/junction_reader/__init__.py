"""Junction Reader, a model of this package."""

from dorothie_gym.baselines.junction_reader.features import ExitTable, exit_table, mentions
from dorothie_gym.baselines.junction_reader.model import JunctionReader, reader_config

__all__ = ["ExitTable", "JunctionReader", "exit_table", "mentions", "reader_config"]
