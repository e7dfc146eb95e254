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
    limit: float = 600.0,  # seconds: a case takes up to 120 on two busy processors
    scratch: Sequence[Path] = (),
) -> pd.DataFrame:
    """A row per case, in the grid's order. Times go to ``name_times``.

    While the sweep runs, its store is in the study's folder ``build``, which git ignores. A run that was
    stopped goes on from there. At the end the store and the ``scratch`` files of the cases are removed.

    Raises
    ------
    SweepError : the run was stopped by Ctrl-C; or a case raised, was killed or timed out, so that the table
        would have gaps. The next run of the study runs these cases again.
    """
    store = folder.path / "build" / f"{name}-{sweep.fingerprint[:8]}.sqlite"
    store.parent.mkdir(parents=True, exist_ok=True)
    table = run(sweep, store, workers=workers, time_limit=limit, retry_failed=True)
    if len(table) < len(sweep):
        raise SweepError(
            f"{name}: {len(table)} of {len(sweep)} cases are done and stored in {store}; run the"
            " study again to go on from there",
            what=name,
            found=len(table),
            expected=len(sweep),
        )
    records = read_store(store)
    if failed := [record for record in records if record.failed]:
        first = failed[0]
        raise SweepError(
            f"{name}: {len(failed)} of {len(sweep)} cases failed; case {first.case} {first.status}:"
            f" {first.message}; the output of all is in {store}",
            what=name,
            where=first.case,
            found=first.status,
        )
    times = provenance(records)[["wall_time"]].round(3)
    folder.write_table(f"{name}_times", times.reset_index())
    for path in (store, *scratch):
        path.unlink()
    if not any(store.parent.iterdir()):
        store.parent.rmdir()
    return table
