"""`python -m benchmarks NAME`, at the root of a checkout."""

from benchmarks.commands import main

main()
