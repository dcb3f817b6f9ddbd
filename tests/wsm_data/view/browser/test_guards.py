import pytest
from starlette.responses import PlainTextResponse
from starlette.testclient import TestClient

from wsm_data.view.browser.guards import Guarded, host_name

client = TestClient(Guarded(PlainTextResponse("served")), base_url="http://127.0.0.1:8765")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:8765", "localhost:80"])
def test_the_names_of_this_machine_are_served(host):
    assert client.get("/", headers={"host": host}).text == "served"


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8765", "127.0.0.1.evil.example", "localhost.evil:80", "", "127.0.0.1@evil:80"],
)
def test_a_name_that_was_made_to_point_here_is_refused(host):
    answer = client.get("/", headers={"host": host})
    assert answer.status_code == 403
    assert "served" not in answer.text.split(",")


def test_a_page_of_another_site_may_link_here_and_not_read():
    foreign = {"sec-fetch-site": "cross-site"}
    assert client.get("/", headers={**foreign, "sec-fetch-mode": "no-cors"}).status_code == 403
    assert client.get("/", headers={**foreign, "sec-fetch-mode": "navigate"}).status_code == 200
    assert client.get("/", headers={"sec-fetch-site": "same-origin", "sec-fetch-mode": "cors"}).status_code == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_nothing_can_be_changed(method):
    assert client.request(method, "/").status_code == 405


def test_a_page_may_load_nothing_from_elsewhere_and_run_nothing_that_stands_in_it():
    policy = client.get("/").headers["content-security-policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules.pop("default-src") == "'none'"
    assert set(rules.values()) == {"'self'", "'none'"}
    assert client.get("/").headers["cross-origin-resource-policy"] == "same-origin"


def test_a_host_loses_its_port_and_nothing_else():
    assert [host_name(one) for one in ("a:80", "a", "a:b", "[::1]:80")] == ["a", "a", "a:b", "[::1]"]
