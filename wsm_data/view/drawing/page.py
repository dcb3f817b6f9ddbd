"""HTML pages that need nothing else: their templates, and pictures that stand in the page itself."""

import base64

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup
from matplotlib.figure import Figure

from wsm_data.schema.arrays import Uint8Array
from wsm_data.view.drawing.style import picture_png
from wsm_data.view.drawing.svg import figure_svg
from wsm_data.view.drawing.text_table import bytes_text


def page_template(name: str) -> Template:
    """A template of `wsm_data/view/templates`: whatever is put into it is escaped, a name it does not get is an error.

    The filter `bytes` writes a number of bytes as people read it.
    """
    environment = Environment(
        loader=PackageLoader("wsm_data.view"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["bytes"] = bytes_text
    return environment.get_template(name)


def inline_svg(figure: Figure, name: str, description: str) -> Markup:
    """`figure_svg` as markup that a template does not escape again."""
    # Safe as markup: matplotlib escapes the text of a figure, `figure_svg` escapes the description.
    return Markup(figure_svg(figure, name, description))  # noqa: S704


def data_url(picture_u8: Uint8Array) -> str:
    """A picture, uint8 [H, W, 3], as the address of an image that is its own content."""
    return "data:image/png;base64," + base64.b64encode(picture_png(picture_u8)).decode()
