"""The Junction Reader, our own model."""

from dorothie_gym.baselines.junction_reader.exits import ExitTable, exit_table
from dorothie_gym.baselines.junction_reader.features import mentions
from dorothie_gym.baselines.junction_reader.model import JunctionReader, reader_config

__all__ = ["ExitTable", "JunctionReader", "exit_table", "mentions", "reader_config"]
