"""The check of the built pages finds each kind of fault, and only faults."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = """<!doctype html><html lang="en"><head><title>page</title></head>
<body style="background: white; color: black"><article><p>A page.</p>{body}</article></body></html>"""
PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw=="
FAULTS = {
    "too wide": '<div style="width: 700px">wide</div>',
    "image-alt": f'<img src="{PIXEL}">',
    "color-contrast": '<p style="color: #bbb">pale</p>',
    "link-name": '<a href="#there"><span style="display: none">hidden</span></a>',
    "not loaded": '<img src="missing.png" alt="a picture">',
    "line cut": f'<div class="highlight"><pre style="overflow: auto">{"x" * 500}</pre></div>',
}


@pytest.fixture(scope="module")
def check():
    pytest.importorskip("playwright", reason="playwright is not installed: pip install --group browser")
    pytest.importorskip("axe_playwright_python", reason="axe is not installed: pip install --group browser")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        module = importlib.import_module("check_pages")
    if module.chromium() is None:
        pytest.skip("Chromium is not installed")
    return module


@pytest.mark.parametrize("ci", ["", "true"])
def test_without_a_browser_nothing_is_checked_and_ci_fails(monkeypatch, capsys, ci):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        module = importlib.import_module("check_pages")
    monkeypatch.setattr(module, "chromium", lambda: None)
    monkeypatch.setattr("sys.argv", ["check_pages.py", "docs"])
    monkeypatch.setenv("CI", ci)
    assert module.main() == bool(ci)
    assert "NOT CHECKED" in capsys.readouterr().err


def test_each_kind_of_fault_is_found_and_a_good_page_has_none(check, tmp_path):
    for kind, body in {**FAULTS, "good": ""}.items():
        (tmp_path / f"{kind}.html").write_text(PAGE.format(body=body))
    found = check.faults(sorted(tmp_path.glob("*.html")), tmp_path, None)
    kinds = {
        kind: [fault for fault in found if fault.startswith(f"{kind}.html")] for kind in [*FAULTS, "good"]
    }
    assert kinds.pop("good") == []
    for kind, faults in kinds.items():
        assert faults, kind
        assert all(f": {kind}" in fault for fault in faults), faults
