"""What a search leaves on the disk: table, picture, page, drawings and scenario files."""

from __future__ import annotations

from geometry2d.drawings.neck_file import write_neck
from geometry2d.foundation.output import file_at_once
from scenarios.campaign.table import write_csv
from scenarios.optimum.figures import search_figure
from scenarios.optimum.found import (
    PICTURE_FILE,
    TRIALS_FILE,
    Optimum,
    package_of,
    rounded,
    sign_of,
)
from scenarios.optimum.page import write_page
from scenarios.settings.writing import toml_value


def write_optimum(found: Optimum) -> None:
    """Write table and page of the trials, and drawings and scenario files of the best."""
    wanted = found.settings
    rows = [
        {
            "trial": trial.number,
            **rounded(trial.values),
            **found.measures(trial),
            "mesh_doubt": trial.evaluation.mesh_doubt,
            "feasible": trial.evaluation.is_feasible,
            "best": trial in found.best,
        }
        for trial in found.trials
    ]
    write_csv(rows, found.folder / TRIALS_FILE)
    signs = [sign_of(name) for name in wanted.objectives]
    picture = search_figure(found.trials, found.best, wanted.objectives, signs)
    with file_at_once(found.folder / PICTURE_FILE) as partial:
        partial.write_bytes(picture.data)
    for trial in found.best:
        values = rounded(trial.values)
        place = found.folder / found.place(trial)
        place.parent.mkdir(parents=True, exist_ok=True)
        for ending in (".dxf", ".svg"):
            write_neck(found.section(trial), place.with_suffix(ending))
        lines = [f"{key} = {toml_value(v)}" for key, v in package_of(wanted, values).items()]
        base = wanted.study.base
        there = wanted.study.folder / base
        named = str(there) if there.is_file() else base
        text = "\n".join([f"base = {toml_value(named)}", "", "[package]", *lines, ""])
        with file_at_once(place.with_suffix(".toml")) as partial:
            partial.write_text(text, encoding="utf-8")
    write_page(found)
