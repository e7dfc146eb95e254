"""What every room uses: errors, array types, options checked, files written whole, Ctrl-C, compiled loops.

Imports nothing of pcmc from outside this folder.
"""
