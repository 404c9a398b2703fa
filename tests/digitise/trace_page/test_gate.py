"""Who gets past the trace page's gate, header by header."""

from email.message import Message

import pytest

from digitise.trace_page.server import LARGEST_BODY_BYTES, RequestGate

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


def _refused_with(gate, headers, method="POST"):
    refusal = gate.refuses(method, f"/{gate.token}/trace", headers)
    return None if refusal is None else refusal[0].value


def test_the_page_itself_gets_in(gate):
    assert _refused_with(gate, _posted()) is None
    assert _refused_with(gate, _posted(Host=f"localhost:{PORT}", Origin=f"http://localhost:{PORT}")) is None
    assert _refused_with(gate, _headers(("Host", OWN)), method="GET") is None


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


@pytest.mark.parametrize(
    "host", [None, "", "evil.example", f"evil.example:{PORT}", "127.0.0.1", f"127.0.0.1:{PORT + 1}"]
)
def test_under_another_name_this_machine_does_not_answer(gate, host):
    """DNS rebinding: a site whose name resolves to 127.0.0.1 still sends its own name."""
    assert _refused_with(gate, _posted(Host=host)) == 421


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "null",
        "http://evil.example",
        f"https://{OWN}",
        f"http://127.0.0.1:{PORT + 1}",
        f"http://{OWN}.evil.example",
    ],
)
def test_another_sites_page_cannot_post(gate, origin):
    assert _refused_with(gate, _posted(Origin=origin)) == 403


@pytest.mark.parametrize("length", [str(LARGEST_BODY_BYTES + 1), "9" * 9])
def test_a_large_body_is_refused_by_its_announcement(gate, length):
    assert _refused_with(gate, _posted(Content_Length=str(LARGEST_BODY_BYTES))) is None
    assert _refused_with(gate, _posted(Content_Length=length)) == 413


@pytest.mark.parametrize("length", [None, "-1", "+2", "2.0", "0x2", "²", "9" * 30])
def test_a_body_of_unsure_length_is_refused(gate, length):
    assert _refused_with(gate, _posted(Content_Length=length)) == 411
