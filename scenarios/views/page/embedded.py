"""Files that a page holds: as the addresses of images and of links."""

from __future__ import annotations

import base64
from dataclasses import dataclass

from scenarios.views.page.hypertext import Markup, tag


@dataclass(frozen=True)
class Embedded:
    """A picture with its media type and what it shows, in words."""

    data: bytes
    media_type: str
    shows: str


def image(picture: Embedded) -> Markup:
    """Return the image of a picture that the page holds."""
    return tag("img", src=data_address(picture.data, picture.media_type), alt=picture.shows)


def data_address(data: bytes, media_type: str) -> str:
    """Return the address of a file that the page holds."""
    return f"data:{media_type};base64,{base64.b64encode(data).decode('ascii')}"
