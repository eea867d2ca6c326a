"""Libraries that are imported when something of them is first used."""

from __future__ import annotations

import subprocess
import sys

import pytest

from dorothie_gym.support.libraries import Library


def test_library_is_imported_when_something_of_it_is_used() -> None:
    code = (
        "import sys; from dorothie_gym.support.libraries import pa, pc, pq, pygame\n"
        "assert not {'pyarrow', 'pyarrow.parquet', 'pyarrow.compute', 'pygame'} & set(sys.modules)\n"
        "schema = pa.schema([('a', pa.int64())])\n"
        "assert 'pyarrow' in sys.modules and 'pygame' not in sys.modules\n"
        "assert pa.Schema is sys.modules['pyarrow'].Schema and isinstance(schema, pa.Schema)\n"
        "assert pq.ParquetFile is sys.modules['pyarrow.parquet'].ParquetFile\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_missing_library_and_missing_name_are_reported_when_they_are_used() -> None:
    missing = Library("dorothie_gym_no_such_library")
    with pytest.raises(ModuleNotFoundError, match="dorothie_gym_no_such_library"):
        _ = missing.anything
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = Library("json").no_such_name


def test_its_values_are_those_of_the_module() -> None:
    library = Library("json")
    assert library.dumps is library.dumps and library.dumps({"a": 1}) == '{"a": 1}'  # type: ignore[operator]  # a function
    assert repr(library) == "<library json>"
