"""The head of every page says to the browser that it loads nothing from elsewhere."""

from __future__ import annotations

from importlib.resources import files

from truepose.reporting import shell


def test_policy_stands_before_all_that_it_governs() -> None:
    page = files("truepose.reporting").joinpath("base.html.jinja").read_text(encoding="utf-8")
    policy = page.index("Content-Security-Policy")
    assert "{{ policy" in page[policy : page.index("<title>")]
    assert policy < min(page.index(tag) for tag in ("<style>", "<script", "<link"))


def test_only_a_page_with_a_live_part_compiles_and_has_a_worker() -> None:
    static, live = (shell.policy("run()", live=live) for live in (False, True))
    assert static.startswith("default-src 'none'; ")
    assert "wasm" not in static
    assert "worker" not in static
    assert live == static.replace(
        " 'strict-dynamic'", " 'strict-dynamic' 'wasm-unsafe-eval'; worker-src blob:"
    )
