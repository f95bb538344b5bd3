"""The scene as one HTML file that opens without a server."""

from __future__ import annotations

from contextlib import contextmanager
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import viser

_STYLE = (
    "position:fixed;right:1em;top:1em;z-index:10;max-width:22em;max-height:80vh;overflow:auto;border-radius:6px;"
    "font-family:Inter,sans-serif;padding-top:0.6em;"
)
_COLORS = {
    False: "background:#fffffff0;color:#212529;box-shadow:0 1px 4px #0003",
    True: "background:#2e2e2ef0;color:#e0e0e0;box-shadow:0 1px 4px #000a",
}


def html_of(
    server: viser.ViserServer,
    handles: Sequence[Any],
    frames: Sequence[tuple[float, Callable[[], object]]],
    text: str,
    *,
    title: str,
    dark: bool,
) -> str:
    """Return the page of the scene as it is now, by viser's own export.

    Parameters
    ----------
    server : viser.ViserServer
        What shows the scene.
    handles : sequence
        Scene nodes to drag; a page without a server has none.
    frames : sequence of (float, callable)
        Pictures to play: seconds since the one before, and the call that draws it.
    text : str
        HTML of the box that stands beside the scene.
    """
    # Clients see none of this: of several values within one atomic block they are sent the last one.
    with server.atomic():
        recorder = server.get_scene_serializer()
        with _hidden(handles):
            for seconds, draw in frames:
                recorder.insert_sleep(seconds)
                draw()
            if frames:
                recorder.insert_sleep(frames[-1][0])
            page = recorder.as_html(dark_mode=dark)
    box = f"<div style='{_STYLE}{_COLORS[dark]}'><b style='padding:0 0.75em'>{escape(title)}</b>{text}</div>"
    page = titled(page, title)
    end = page.rindex("</body>")
    return page[:end] + box + page[end:]


def titled(page: str, title: str) -> str:
    """Put a title in place of viser's."""
    return page.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1)


@contextmanager
def _hidden(handles: Sequence[Any]) -> Iterator[None]:
    for handle in handles:
        handle.visible = False
    try:
        yield
    finally:
        for handle in handles:
            handle.visible = True
