# SPDX-License-Identifier: MIT
"""The one script that the theme would fetch from the network, from the site itself."""

_FETCHED = "https://unpkg.com/iframe-worker/shim"
_OWN = "assets/iframe-worker.js"


def on_post_page(output, page, **_):
    """Point to our copy."""
    return output.replace(_FETCHED, "../" * page.url.count("/") + _OWN)


def on_post_template(output_content, **_):
    """The same for pages without a source, such as 404.html."""
    return output_content.replace(_FETCHED, _OWN)
