"""The paper's examples and our questions, as commands: ``python -m studies list``.

A study turns data into tables and tables into figures, in three separate steps, and writes only in
its own folder of ``results/``. What the paper prints is data too (``paper.toml``), and the
comparison with it is computed.
"""
