"""Stability: sparse factorisation with inertia, lowest modes, Morse index.

Gives these to the certificate and the solvers. Imports ``forces`` and the rooms below it.
"""
