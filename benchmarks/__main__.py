"""The command `python -m benchmarks`, at the root of a checkout."""

from benchmarks.commands import main

main()
