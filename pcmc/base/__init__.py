"""For all subpackages: errors, array types, checks, units, atomic file writing, interrupts, compiled loops.

Imports nothing of pcmc from outside this folder.
"""
