"""A study of one number, in a file that imports little: the hashes of its code are soon made."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pandas as pd

from pcmc.base.errors import OptionError
from studies.folder import Folder
from studies.study import Study


def tiny_study(
    name: str = "tiny", fail: str = "", figure: Callable[[Folder], Any] = lambda folder: None
) -> Study:
    """It writes x = 2, and x = 1 in a short run; ``fail`` names the step that is refused."""

    def data(folder: Folder, short: bool) -> None:
        if fail == "data":
            raise OptionError("no data")
        folder.write_table("records", pd.DataFrame({"x": [1.0 if short else 2.0]}))

    def table(folder: Folder) -> dict[str, float]:
        return {"x": folder.read_table("records").x[0]}

    return Study(name, "a test", data, table, figure, parameters={"a": 1})
