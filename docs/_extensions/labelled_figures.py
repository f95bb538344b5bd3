"""Figures of the gallery, whose labels are their alternative texts."""

import re
from weakref import WeakSet

import matplotlib.pyplot as plt
from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper

from graspforce.plotting.style import InlineFigure

RESOLUTION = 140  # more pixels than a page is wide, for sharp screens
saved = WeakSet()


def labelled(block, block_vars, gallery_conf, **options):
    """Save the figures of a block. A figure without a label (``figure.set_label``) is an error."""
    own = {id(f): f for f in block_vars["example_globals"].values() if isinstance(f, InlineFigure)}.values()
    own = [figure for figure in own if figure not in saved]
    labels = [plt.figure(number).get_label() for number in plt.get_fignums()]
    labels += [figure.get_label() for figure in own]
    if not all(labels):
        raise ValueError(
            f"{block_vars['src_file']}: a figure has no label, the text for those who cannot see it"
        )
    text = matplotlib_scraper(block, block_vars, gallery_conf, **{"dpi": RESOLUTION, **options})
    for figure in own:
        path = next(block_vars["image_path_iterator"])
        figure.savefig(path, dpi=RESOLUTION)
        saved.add(figure)
        text += figure_rst([path], gallery_conf["src_dir"], figure.get_label())
    shown = iter(labels)
    return re.sub(r":alt: .*", lambda _: f":alt: {next(shown)}", text)
