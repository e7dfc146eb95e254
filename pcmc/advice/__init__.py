"""What to choose: tensions for a rise, rings for masts, cables for sails; what to type where a roof fails.

Gives these to projects. May import ``design`` and the subpackages below them.
"""
