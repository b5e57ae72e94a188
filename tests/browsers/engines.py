"""The three engines of browsers by name, each with one page and without a network."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.browsers.chromium import SOFTWARE, open_browser
from tests.browsers.firefox import open_firefox
from tests.browsers.local_site import LocalSite
from tests.browsers.page import Page
from tests.browsers.webkit import open_webkit
from tests.xvfb import x_server

ENGINES = ("chromium", "firefox", "webkit")


@contextmanager
def open_engine(name: str, site: LocalSite) -> Iterator[Page]:
    """Start a browser, which reaches only the site; yield its page. It prefers reduced motion."""
    if name == "chromium":
        flags = *SOFTWARE, f"--proxy-server=127.0.0.1:{site.server_port}"
        with tempfile.TemporaryDirectory() as folder, open_browser(*flags) as browser:
            tab = browser.new_tab()
            tab.downloads = Path(folder)
            browser.save_to(tab.downloads)
            tab.prefer(prefers_reduced_motion="reduce")
            yield tab
    else:
        opener = {"firefox": open_firefox, "webkit": open_webkit}[name]
        with x_server() as display, opener(display, site.server_port) as page:
            yield page
