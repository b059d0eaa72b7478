# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# tools/examples/notebook.py without a screen: three figures that show something. The README's lines, too.
import os
import pathlib
import re
import runpy

import numpy
import pytest

from conftest import SOURCE

matplotlib = pytest.importorskip("matplotlib")


@pytest.mark.filterwarnings("ignore:.*non-GUI backend.*", "ignore:.*non-interactive.*")
def test_the_notebook_draws_three_figures(monkeypatch, tmp_path):
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.close("all")
    made = runpy.run_path(str(SOURCE / "tools" / "examples" / "notebook.py"))
    out = pathlib.Path(os.environ.get("OVERTAKE_FIGURES", tmp_path))
    figures = [plt.figure(number) for number in plt.get_fignums()]
    assert len(figures) == 3
    for number, figure in enumerate(figures, 1):
        figure.savefig(out / f"figure_{number}.png", dpi=80)
        pixels = numpy.asarray(figure.canvas.buffer_rgba())
        assert len(numpy.unique(pixels.reshape(-1, 4), axis=0)) > 50, f"figure {number} is blank"
        for axes in figure.axes:
            assert axes.get_xlabel() or axes.get_ylabel()
    race, runs = made["race"], made["runs"]
    assert {len(frames) for frames in runs.values()} == {race.frame_count}
    map_axes, error_axes = figures[0].axes[0], figures[1].axes[0]
    labels = [text.get_text() for text in map_axes.get_legend().get_texts()]
    assert {"own car", "confirmed tracks, best", "confirmed tracks, paper"} <= set(labels)
    best = error_axes.get_lines()[0].get_ydata()
    assert numpy.isfinite(best).sum() > 0.5 * race.frame_count and numpy.nanmedian(best) < 1
    purple = [line for line in figures[2].axes[0].get_lines() if line.get_color() == "tab:purple"]
    assert sum(len(line.get_xdata()) for line in purple) > 50
    plt.close("all")


@pytest.mark.parametrize("document", ["README.md", "tools/python/README.md"])
def test_the_first_lines_of_the_documents_run(monkeypatch, tmp_path, capsys, document):
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.close("all")
    monkeypatch.chdir(tmp_path)
    code = re.search(r"```python\n(.*?)```", (SOURCE / document).read_text(), re.S)[1]
    exec(compile(code.replace("seconds=5", "seconds=1"), document, "exec"), {})
    if document == "README.md":
        points = [line.get_xydata() for line in plt.gca().get_lines()]
        assert (tmp_path / "tracks.png").stat().st_size > 5000 and sum(len(rows) for rows in points) > 10
    else:
        assert len(capsys.readouterr().out.splitlines()) == 20
    plt.close("all")
