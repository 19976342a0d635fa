"""The head of every page says to the browser that it loads nothing from elsewhere."""

from __future__ import annotations

from importlib.resources import files


def test_policy_stands_before_all_that_it_governs() -> None:
    page = files("truepose.reporting").joinpath("base.html.jinja").read_text(encoding="utf-8")
    policy = page.index("Content-Security-Policy")
    assert "default-src 'none'" in page[policy : page.index("<title>")]
    assert policy < min(page.index(tag) for tag in ("<style>", "<script", "<link"))
