# SPDX-License-Identifier: MIT
"""Formulas become MathML when the site is built: browsers draw it themselves, without scripts or fonts."""

import html
import re

from latex2mathml.converter import convert

_FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)


def on_page_content(page_html, **_):
    """Replace what arithmatex has marked."""
    return _FORMULA.sub(_as_mathml, page_html)


def _as_mathml(match):
    display = "block" if match["tag"] == "div" else "inline"
    mathml = convert(html.unescape(match["latex"]).strip(), display=display)
    return f'<{match["tag"]} class="formula">{mathml}</{match["tag"]}>'
