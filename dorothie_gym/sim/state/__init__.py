"""State of a world as arrays of records, which compiled loops step.

`town_arrays` reads a town once; a `WorldArrays` is the state of one world in it, filled by `populate` or the `add_...`
functions; `step` steps it. Compiled and in plain Python (``NUMBA_DISABLE_JIT=1``) the result is the same, byte by
byte, and it is a function of the state alone: of seed and actions, not of the process or the order of worlds.
"""
