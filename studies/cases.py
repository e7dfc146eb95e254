"""A sweep inside a study: resumable, its numbers and its times in separate tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pcmc.base.errors import SweepError
from pcmc.sweep import Sweep, provenance, read_store, run

from .folder import Folder


def run_sweep(
    folder: Folder,
    name: str,
    sweep: Sweep,
    *,
    workers: int | None = None,
    limit: float = 120.0,
    scratch: Sequence[Path] = (),
) -> pd.DataFrame:
    """A row per case, in the grid's order. Times go to ``name_times``.

    While it runs, the cases are stored in the study's folder ``build``, which no commit takes in. A
    run that was stopped goes on from there; one that ends takes the store and the ``scratch`` files of its
    cases away.

    Raises
    ------
    SweepError : the run was stopped (Ctrl-C), and is not complete; or a case raised, was killed or
        timed out: a table would have holes. The study's next run tries it again.
    """
    store = folder.path / "build" / f"{name}-{sweep.fingerprint[:8]}.sqlite"
    store.parent.mkdir(parents=True, exist_ok=True)
    table = run(sweep, store, workers=workers, time_limit=limit, retry_failed=True)
    if len(table) < len(sweep):
        raise SweepError(
            f"{name}: {len(table)} of {len(sweep)} cases are done and kept in {store}; run the"
            " study again to go on from there"
        )
    records = read_store(store)
    if failed := [record for record in records if record.failed]:
        first = failed[0]
        raise SweepError(
            f"{name}: {len(failed)} of {len(sweep)} cases failed; case {first.case} {first.status}:"
            f" {first.message}; the output of all is kept in {store}"
        )
    times = provenance(records)[["wall_time"]].round(3)
    folder.write_table(f"{name}_times", times.reset_index())
    for path in (store, *scratch):
        path.unlink()
    if not any(store.parent.iterdir()):
        store.parent.rmdir()
    return table
