"""Who may speak to the trace page: this machine's browser, with the page's own address, and in small portions."""

import secrets
from collections.abc import Sequence
from email.message import Message
from http import HTTPStatus
from typing import NamedTuple

LARGEST_BODY_BYTES = 64_000
"""The hints of a page are some kilobytes."""


class Refusal(NamedTuple):
    """Why a request is turned away."""

    status: HTTPStatus
    reason: str


class Gate:
    """The token that the page's address holds, and the names under which this machine may be called."""

    def __init__(self, port: int) -> None:
        self.token = secrets.token_urlsafe(32)
        # Any other name is another site's that resolves to this machine (DNS rebinding).
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._origins = {f"http://{host}" for host in self._hosts}

    def refuses(self, method: str, target: str, headers: Message) -> Refusal | None:
        """None where the request may come in; its body is not read for that."""
        if _only(headers.get_all("Host")) not in self._hosts:
            return Refusal(HTTPStatus.MISDIRECTED_REQUEST, "this page answers to 127.0.0.1 and localhost only")
        token = target.removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return Refusal(HTTPStatus.FORBIDDEN, "the address lacks the token that 'sealtwin trace' printed")
        if headers.get_all("Transfer-Encoding"):
            return Refusal(HTTPStatus.LENGTH_REQUIRED, "a body needs a Content-Length")
        return self._refuses_post(headers) if method == "POST" else _refuses_get(headers)

    def _refuses_post(self, headers: Message) -> Refusal | None:
        # Another site's page can send here what it cannot read: a browser then names that site.
        if _only(headers.get_all("Origin")) not in self._origins:
            return Refusal(HTTPStatus.FORBIDDEN, "sent from another page than this one")
        if headers.get_content_type() != "application/json":
            return Refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "the body must be application/json")
        length = _only(headers.get_all("Content-Length"))
        if length is None or not (length.isascii() and length.isdigit()):
            return Refusal(HTTPStatus.LENGTH_REQUIRED, "a body needs one Content-Length")
        if len(length) > len(str(LARGEST_BODY_BYTES)) or int(length) > LARGEST_BODY_BYTES:
            return Refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"the body is larger than {LARGEST_BODY_BYTES} bytes")
        return None


def _refuses_get(headers: Message) -> Refusal | None:
    if headers.get("Content-Length", "0") != "0":
        return Refusal(HTTPStatus.BAD_REQUEST, "a GET has no body")
    return None


def _only(values: Sequence[str] | None) -> str | None:
    return values[0] if values is not None and len(values) == 1 else None
