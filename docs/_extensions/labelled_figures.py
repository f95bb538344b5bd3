"""Figures of the gallery, whose labels are their alternative texts."""

import re

import matplotlib.pyplot as plt
from sphinx_gallery.scrapers import matplotlib_scraper


def labelled(block, block_vars, gallery_conf, **options):
    """Save the figures of a block. A figure without a label (``figure.set_label``) is an error."""
    labels = [plt.figure(number).get_label() for number in plt.get_fignums()]
    if not all(labels):
        raise ValueError(
            f"{block_vars['src_file']}: a figure has no label, the text for those who cannot see it"
        )
    # More pixels than a page is wide, for sharp screens.
    text = matplotlib_scraper(block, block_vars, gallery_conf, **{"dpi": 140, **options})
    shown = iter(labels)
    return re.sub(r":alt: .*", lambda _: f":alt: {next(shown)}", text)
