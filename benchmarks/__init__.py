"""Measurements of a checkout, which are not part of the package.

`python -m benchmarks NAME` measures a speed against a reference in the same run: `commands` reads the options, each
module that it names has a function `measure` that returns the figures of `--json`, and `report` words and draws them.
The other modules are scripts of their own; README.md lists both. Recorded figures are in the folder `results`.
"""
