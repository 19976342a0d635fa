"""The studio's page in a real browser: it runs under its policy, and talks with nobody else."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from typing import Any

import pytest

import truepose as tp
from browser import Heard
from command_line import MACHINES, PLANAR
from served_studio import ServedStudio, studio_of
from truepose.studio.page import studio_page

PATIENCE = 60_000
"""Milliseconds: a busy machine is slow, and slowness is no fault here."""

FIRST_MESSAGE = """address => new Promise(resolve => {
  try {
    const socket = new WebSocket(address);
    socket.onmessage = event => { resolve(JSON.parse(event.data).type); socket.close(); };
    socket.onerror = () => resolve("refused");
  } catch (failure) {
    resolve("refused");
  }
})"""
ASKED = """address => fetch(address).then(answer => answer.status, () => "refused")"""


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedStudio]:
    folder = tmp_path_factory.mktemp("page")
    (folder / "m.toml").write_bytes(PLANAR.read_bytes())
    with studio_of(folder / "m.toml", folder / "state") as one:
        yield one


@pytest.fixture
def page(browser: Any, studio: ServedStudio) -> Iterator[tuple[Any, Heard]]:
    page, heard = browser.new_page(), Heard()
    heard.listen(page)
    page.goto(studio.address, wait_until="load")
    page.wait_for_selector("html[data-live-ready=drawn]", timeout=PATIENCE)
    yield page, heard
    page.close()


def test_the_page_works_under_its_policy_and_asks_nobody_else(
    page: tuple[Any, Heard], studio: ServedStudio
) -> None:
    tab, heard = page
    settled = "() => document.getElementById('live').dataset.settled === 'yes'"
    tab.wait_for_function(settled, timeout=PATIENCE)
    assert heard.complaints == []
    allowed = (f"http://{studio.host}/", "data:", "blob:")
    assert [url for url in heard.requests if not url.startswith(allowed)] == []


def test_the_page_reaches_its_own_socket_and_no_other(
    page: tuple[Any, Heard], studio: ServedStudio
) -> None:
    tab, heard = page
    own = f"ws://{studio.host}/socket?token={studio.token}"
    assert tab.evaluate(FIRST_MESSAGE, own) == "state"
    assert tab.evaluate(FIRST_MESSAGE, own + "x") == "refused"
    heard.complaints.clear()
    with socket.create_server(("127.0.0.1", 0)) as other:
        # There is somebody who listens; the policy does not let the page ask.
        foreign = f"127.0.0.1:{other.getsockname()[1]}"
        assert tab.evaluate(FIRST_MESSAGE, f"ws://{foreign}/socket") == "refused"
        assert tab.evaluate(ASKED, f"http://{foreign}/") == "refused"
        other.settimeout(0.2)
        with pytest.raises(TimeoutError):
            other.accept()
    assert any("Content Security Policy" in text for text in heard.complaints)
    assert tab.evaluate(ASKED, f"/?token={studio.token}") == 200
    assert tab.evaluate(ASKED, "/?token=wrong") == 403


def test_a_page_of_another_site_gets_nothing(browser: Any, studio: ServedStudio) -> None:
    """With the token even: its browser says where it comes from."""
    tab = browser.new_page()
    tab.route("http://attacker.example/", lambda route: route.fulfill(body="<p>hello"))
    tab.goto("http://attacker.example/")
    own = f"ws://{studio.host}/socket?token={studio.token}"
    assert tab.evaluate(FIRST_MESSAGE, own) == "refused"
    assert tab.evaluate(ASKED, studio.address) == "refused"
    tab.close()


def test_a_machine_without_a_live_part_has_a_page_that_says_so() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml", ["workspace.grid.x=[9000, 9100, 3]"])
    page = studio_page(machine, "127.0.0.1:8768")
    setting = page.text.partition('id="live-setting">')[2].partition("</script>")[0]
    told = json.loads(setting)
    assert told["bundle"] is None
    assert told["why"]
    assert "connect-src 'self' ws://127.0.0.1:8768" in page.policy
    assert machine.name in page.text
