"""Who gets past the trace page's gate, header by header."""

from email.message import Message

import pytest

from digitise.trace_page.page import LARGEST_BODY_BYTES, RequestGate

PORT = 8123
OWN = f"127.0.0.1:{PORT}"


@pytest.fixture
def gate():
    return RequestGate(PORT)


def _headers(*fields):
    headers = Message()
    for name, value in fields:
        headers[name] = value
    return headers


def _posted(**changed):
    """The headers of the page's own POST, some of them changed or (None) left out."""
    fields = {"Host": OWN, "Origin": f"http://{OWN}", "Content-Length": "2"}
    fields |= {name.replace("_", "-"): value for name, value in changed.items()}
    return _headers(*((name, value) for name, value in fields.items() if value))


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({}, None),
        ({"Host": f"localhost:{PORT}", "Origin": f"http://localhost:{PORT}"}, None),
        ({"Content_Length": str(LARGEST_BODY_BYTES)}, None),
        # DNS rebinding: a site whose name resolves to 127.0.0.1 still sends its own name.
        *(({"Host": host}, 421) for host in (None, "", "evil.example", f"evil.example:{PORT}", "127.0.0.1")),
        ({"Host": f"127.0.0.1:{PORT + 1}"}, 421),
        # Another site's page cannot post.
        *(({"Origin": origin}, 403) for origin in (None, "null", "http://evil.example", f"https://{OWN}")),
        *(({"Origin": f"http://{name}"}, 403) for name in (f"127.0.0.1:{PORT + 1}", f"{OWN}.evil.example")),
        # A large body is refused by its announcement, one of unsure length as such.
        *(({"Content_Length": length}, 413) for length in (str(LARGEST_BODY_BYTES + 1), "9" * 9, "9" * 30)),
        *(({"Content_Length": length}, 413) for length in (None, "-1", "+2", "2.0", "0x2", "²")),
    ],
)
def test_only_the_pages_own_post_gets_in(gate, changed, status):
    refusal = gate.refuses("POST", f"/{gate.token}/trace", _posted(**changed))
    assert (refusal and refusal[0].value) == status


def test_a_get_needs_no_origin(gate):
    assert gate.refuses("GET", f"/{gate.token}/", _headers(("Host", OWN))) is None


@pytest.mark.parametrize(
    "target",
    ["/", "/trace", "//trace", "/{other}/trace", "/{start}/trace", "/{token}x/", "/é/", "http://{own}/{token}/"],
)
def test_without_the_token_nobody_gets_in(gate, target):
    """Another session's token, a part of this one, letters that no token has, an address in full: all are no token."""
    written = target.format(other=RequestGate(PORT).token, start=gate.token[:-1], token=gate.token, own=OWN)
    refusal = gate.refuses("GET", written, _headers(("Host", OWN)))
    assert refusal is not None
    assert refusal[0] == 403


def test_tokens_cannot_be_guessed(gate):
    """32 random bytes, 43 letters: nobody tries 2^256 of them."""
    assert len(gate.token) == 43
    assert len({RequestGate(PORT).token for _ in range(100)}) == 100
